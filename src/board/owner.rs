//! The task that owns the module: polls it every millisecond and brings it the telegrams of all links.

use core::cell::RefCell;

use cortex_m::peripheral::SCB;
use embassy_embedded_hal::shared_bus::blocking::spi::SpiDeviceWithConfig;
use embassy_futures::select::{Either, select};
use embassy_stm32::gpio::{Input, Output};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_time::{Instant, Timer};
use heapless::Vec;

use super::mail::{Outgoing, PAGE, REQUESTS, RS485, WRITTEN};
use super::now;
use super::tmcm1140::{Bus, Motion, Signals, drivers_off, tmc262_spi, tmc429_spi};
use crate::module::{Answer, Inputs, Module, Outputs, Parts, Source, Spec};
use crate::store::Store;
use crate::tmcl::binary::Telegram;

/// A chip on SPI1, with its own clock.
type Chip<'a> = SpiDeviceWithConfig<'a, NoopRawMutex, Bus, Output<'static>>;

/// The module on this board.
type Core<'a> = Module<Chip<'a>, Chip<'a>, Output<'static>, (), 1>;

/// Telegrams that wait until their link has its last reply.
type Held = Vec<(Source, Telegram), 4>;

/// Runs the module.
#[embassy_executor::task]
pub(super) async fn own(spec: &'static Spec, motion: Motion, store: Store, seed: u32) {
    let Motion { bus, select_tmc429, select_tmc262, enable, mut signals } = motion;
    // Each transaction gives the bus the clock of its chip. Chip select is to be low for three clocks of the
    // TMC429 - 188 ns, 32 cycles here - before the first edge and after the last. The SPI driver takes 57 cycles
    // to the first byte, and it waits for the end of the last bit, half a bit (64 cycles) after its edge.
    let bus = Mutex::new(RefCell::new(bus));
    let parts = Parts {
        tmc429: Chip::new(&bus, select_tmc429, tmc429_spi()),
        tmc262: [Chip::new(&bus, select_tmc262, tmc262_spi())],
        enable,
    };
    let mut module = Module::new(spec, parts, (), store, now(), seed);
    defmt::info!("module runs at address {=u8}", module.links().address);

    let mut held = Held::new();
    loop {
        let tick = Timer::at(Instant::from_ticks(module.deadline().0));
        // Requests are looked at first, since setting the alarm takes its time.
        if let Either::First((source, telegram)) = select(REQUESTS.receive(), tick).await {
            if !module.awaits(source) {
                serve(&mut module, source, &telegram);
            } else if held.push((source, telegram)).is_err() {
                defmt::warn!("a host does not wait for its replies: telegram dropped");
            }
        }
        // After each request, too: a busy host does not hold up the motor.
        if now() < module.deadline() {
            continue;
        }
        let outputs = module.poll(now(), &signals.read());
        signals.write(&outputs);
        exchange(&mut module);
        release(&mut module, &mut held);
        if outputs.restart && RS485.is_empty() {
            defmt::info!("restart");
            drivers_off();
            SCB::sys_reset();
        }
    }
}

/// Brings the EEPROM its pages and the links the replies that have become due.
fn exchange(module: &mut Core) {
    if let Some(written) = WRITTEN.try_take() {
        if !written {
            defmt::warn!("EEPROM: a page could not be written");
        }
        module.stored(written);
    }
    if let Some(job) = module.store().next_job() {
        PAGE.signal(job);
    }
    while let Some((source, telegram)) = module.next_telegram() {
        send(source, telegram, module.links().pause);
    }
}

/// Serves the telegrams whose links have become free, oldest first.
fn release(module: &mut Core, held: &mut Held) {
    while let Some(index) = held.iter().position(|(source, _)| !module.awaits(*source)) {
        let (source, telegram) = held.remove(index);
        serve(module, source, &telegram);
    }
}

fn serve(module: &mut Core, source: Source, telegram: &Telegram) {
    if let Answer::Now(reply) = module.serial(now(), source, telegram) {
        send(source, reply, module.links().pause);
    }
}

fn send(source: Source, telegram: Telegram, pause: u8) {
    if source == Source::Rs485 && RS485.try_send(Outgoing { telegram, pause }).is_err() {
        defmt::warn!("RS485: more replies than fit, one dropped");
    }
}

impl Signals {
    fn read(&self) -> Inputs {
        Inputs { digital: self.inputs.each_ref().map(Input::is_high), stall: self.stall.is_high(), ..Inputs::default() }
    }

    fn write(&mut self, outputs: &Outputs) {
        for (bit, pin) in self.outputs.iter_mut().enumerate() {
            pin.set_level((outputs.digital >> bit & 1 != 0).into());
        }
        self.pull_ups.set_level(outputs.pull_ups.into());
        self.led.set_level(outputs.led.into());
    }
}
