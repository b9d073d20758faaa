//! The task that owns the module: polls it every millisecond and brings it the requests of all links.

use core::cell::RefCell;

use cortex_m::peripheral::SCB;
use embassy_embedded_hal::shared_bus::blocking::spi::SpiDeviceWithConfig;
use embassy_futures::select::{Either, select};
use embassy_stm32::gpio::{Input, Output};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_time::{Instant, Timer};
use heapless::Vec;
use static_cell::StaticCell;

use super::mail::{LINKS, Outgoing, PAGE, REQUESTS, RS485, WRITTEN};
use super::now;
use super::tmcm1140::{Bus, Motion, Signals, drivers_off, tmc262_spi, tmc429_spi};
use crate::module::{Answer, Inputs, Mode, Module, Outputs, Parts, Request, Source, Spec, TMCM_1140_AXES};
use crate::store::Store;
use crate::tmcl::Reply;

/// SPI1 with what is on it.
type Shared = Mutex<NoopRawMutex, RefCell<Bus>>;

/// A chip on SPI1, with its own clock.
type Chip = SpiDeviceWithConfig<'static, NoopRawMutex, Bus, Output<'static>>;

/// The module on this board.
pub(super) type Core = Module<Chip, Chip, Output<'static>, (), TMCM_1140_AXES>;

/// Requests that wait until their link has its last reply.
type Held = Vec<(Source, Request), 4>;

/// Builds the module where it stays, with what `load` reads from the EEPROM.
pub(super) fn build(spec: &'static Spec, motion: Motion, load: impl FnOnce(&mut Store), seed: u32) -> Owner {
    static BUS: StaticCell<Shared> = StaticCell::new();
    static MODULE: StaticCell<Core> = StaticCell::new();
    let Motion { bus, select_tmc429, select_tmc262, enable, signals } = motion;
    // Each transaction gives the bus the clock of its chip. Chip select is to be low for three clocks of the
    // TMC429 - 188 ns, 32 cycles here - before the first edge and after the last. The SPI driver takes 57 cycles
    // to the first byte, and it waits for the end of the last bit, half a bit (64 cycles) after its edge.
    let bus = BUS.init(Mutex::new(RefCell::new(bus)));
    let parts = Parts {
        tmc429: Chip::new(bus, select_tmc429, tmc429_spi()),
        tmc262: [Chip::new(bus, select_tmc262, tmc262_spi())],
        enable,
    };
    let module = MODULE.init_with(|| Module::new(spec, parts, (), load, now(), seed));
    defmt::info!("module runs at address {=u8}", module.links().address);
    Owner { module, signals }
}

/// The module and its signals, on their way to the task that owns them.
pub(super) struct Owner {
    pub(super) module: &'static mut Core,
    signals: Signals,
}

// SAFETY: whoever has it has all of it - module, bus, pins -, and gives it away whole.
unsafe impl Send for Owner {}

/// Runs the module.
#[embassy_executor::task]
pub(super) async fn own(owner: Owner) {
    let Owner { module, mut signals } = owner;
    let mut links = *module.links();
    LINKS.lock(|shared| shared.set(Some(links)));
    let mut held = Held::new();
    // RS485 waits for an answer that comes later.
    let mut owed = false;
    loop {
        let tick = Timer::at(Instant::from_ticks(module.deadline().0));
        // Requests are looked at first, since setting the alarm takes its time.
        if let Either::First((source, request)) = select(REQUESTS.receive(), tick).await {
            if !module.awaits(source) {
                owed |= serve(module, source, &request);
            } else if held.push((source, request)).is_err() {
                defmt::warn!("a host does not wait for its replies: request dropped");
                send(module, source, None, None);
            }
        }
        // After each request, too: a busy host does not hold up the motor.
        if now() < module.deadline() {
            continue;
        }
        let outputs = module.poll(now(), &signals.read());
        signals.write(&outputs);
        exchange(module, &mut owed);
        owed |= release(module, &mut held);
        if links != *module.links() {
            links = *module.links();
            LINKS.lock(|shared| shared.set(Some(links)));
        }
        if outputs.restart && RS485.is_empty() {
            defmt::info!("restart");
            drivers_off();
            SCB::sys_reset();
        }
    }
}

/// Brings the EEPROM its pages and the links the replies that have become due.
fn exchange(module: &mut Core, owed: &mut bool) {
    if let Some(written) = WRITTEN.try_take() {
        if !written {
            defmt::warn!("EEPROM: a page could not be written");
        }
        module.stored(written);
    }
    if let Some(job) = module.store().next_job() {
        PAGE.signal(job);
    }
    // The settings may change with the last reply, and this one goes out under those from before.
    while let (before, Some((source, reply))) = (*module.links(), module.next_serial()) {
        deliver(source, Outgoing { reply: Some(reply), mode: None, links: before });
        *owed &= source != Source::Rs485 || reply.is_event();
    }
    if *owed && !module.awaits(Source::Rs485) {
        // The reply is suppressed: that is the answer.
        *owed = false;
        send(module, Source::Rs485, None, None);
    }
}

/// Serves the requests whose links have become free, oldest first. True if RS485 waits for an answer now.
fn release(module: &mut Core, held: &mut Held) -> bool {
    let mut owed = false;
    while let Some(index) = held.iter().position(|(source, _)| !module.awaits(*source)) {
        let (source, request) = held.remove(index);
        owed |= serve(module, source, &request);
    }
    owed
}

/// Serves one request. True if RS485 waits for the answer.
fn serve(module: &mut Core, source: Source, request: &Request) -> bool {
    let (answer, mode) = module.serial(now(), source, request);
    match answer {
        Answer::Now(reply) => send(module, source, Some(reply), Some(mode)),
        Answer::None => send(module, source, None, Some(mode)),
        Answer::Later => return source == Source::Rs485,
    }
    false
}

fn send(module: &Core, source: Source, reply: Option<Reply>, mode: Option<Mode>) {
    deliver(source, Outgoing { reply, mode, links: *module.links() });
}

fn deliver(source: Source, outgoing: Outgoing) {
    if source == Source::Rs485 && RS485.try_send(outgoing).is_err() {
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
