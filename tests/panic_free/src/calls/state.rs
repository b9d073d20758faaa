//! The store, and the machine that executes programs.

use core::hint::black_box as any;

use super::stand_ins::Chip;
use super::{command, now, text};
use tmcm::chip::at25::At25;
use tmcm::module::ports::Signal;
use tmcm::module::{Slots, factory_reset};
use tmcm::param::USER_VARIABLES;
use tmcm::product::{TMCM_1140, Tmcm1140};
use tmcm::store::{Keeper, Need, Store};
use tmcm::tmcl::{Command, Opcode};
use tmcm::vm::{self, Awaited, Condition, ErrorFlag, Errors, Interrupts, Machine, Registers, Signals};
#[inline(never)]
pub(super) fn store() {
    let mut store = Store::<Tmcm1140>::new();
    any(&mut store);
    store.forget();
    any(&mut store);
    let mut keeper = Keeper::new(At25::new(Chip));
    any(keeper.load(&mut store));
    any(&mut keeper);
    any(&mut store);
    any(keeper.poll(now(), || store.next_job()));
    any(any(Signal::Enable).place());
    let Some(slots): Option<&Slots> = any(TMCM_1140.slots.as_ref()) else { return };
    for slot in [slots.variable(any(0)), slots.axis(any(0), any(0)), slots.coordinate(any(0), any(0)), any(Some(0))] {
        any(slot.map(|slot| store.set(slot, any(0))));
        any(slot.map(|slot| store.get(slot)));
    }
    factory_reset(&mut store);
    any(&mut store);
    any((store.integrity(), store.program(), store.downloading(), store.takes_download()));
    store.begin_download(any(0));
    any(&mut store);
    any(store.download(text()));
    store.end_download();
    any(&mut store);
    any(store.erase(any(0)));
    any(&mut store);
    any((store.settled(any(Need::Settings)), store.is_idle(), store.is_unreachable()));
    any(store.finish(any(true)));
    store.reset(any(true));
    any(&mut store);
    any(store.unreachable());
}

/// A store that makes all its pages durable together.
#[inline(never)]
pub(super) fn epochs() {
    let mut store = Store::<tmcm::product::Tmcm1140Canopen>::new();
    any(&mut store);
    let mut keeper = Keeper::new(At25::new(Chip));
    any(keeper.load(&mut store));
    any((store.lost(), store.is_worn(), store.is_storing(), Store::<tmcm::product::Tmcm1140Canopen>::page_of(any(0))));
    any(store.set(any(0), any(0)));
    store.renew();
    any(&mut store);
    any(keeper.poll(now(), || store.next_job()));
    any(store.finish(any(true)));
    any(&mut store);
}

#[inline(never)]
pub(super) fn machine() {
    let mut registers = any(Registers::default());
    let _ = any(registers.calc(any(0), any(0)));
    let _ = any(registers.calcx(any(0)));
    registers.compare(any(0));
    let mut errors = any(Errors::default());
    errors.raise(any(ErrorFlag::Timeout));
    any(errors.raised(any(ErrorFlag::Timeout)));
    any(errors.clear(any(0)));
    any(Condition::from_number(any(0)).map(|condition| registers.meets(condition, errors)));

    let mut signals = any(Signals::default());
    signals.reached(any(0));
    signals.stall(any(0));
    signals.deviation(any(0));
    signals.stop_switches(any(0), any(true), any(true));
    signals.inputs(any(0));
    let mut interrupts = Interrupts::default();
    any(&mut interrupts);
    interrupts.enable(any(0), any(true));
    interrupts.set_vector(any(0), any(0));
    interrupts.set(any(0), any(0));
    any(interrupts.setting(any(0)));
    interrupts.look(now(), signals, any(true));
    any(interrupts.take());
    interrupts.reset();

    let mut machine = Machine::new(any(0));
    any(&mut machine);
    if let Some(address) = vm::address(any(0), any(0)) {
        machine.run_from(address);
    }
    any(&mut machine);
    any((
        machine.state(),
        machine.counter(),
        machine.wait(),
        machine.waits(),
        machine.runs(),
        machine.busy(),
        machine.calm_until(),
        machine.handles(),
    ));
    if let Some(opcode) = Opcode::from_number(any(0)) {
        any(machine.execute(now(), opcode, command()));
    }
    let (program, mut variables) = (any([[0; Command::SIZE]; 8]), any([0; USER_VARIABLES]));
    any(machine.burst(&program, &mut variables, any(0), |address, command, refused, registers| {
        any((address, command, refused, registers));
    }));
    any((&variables, vm::is_brief(any(0))));
    any(&mut machine);
    machine.enter_handler(now());
    machine.waited(any(Awaited::Ticks), any(true));
    machine.wait_for_store();
    any(&mut machine);
    any(machine.stores());
    machine.stored();
    machine.step();
    machine.run();
    any(&mut machine);
    machine.stop();
    machine.end();
    machine.rewind();
    machine.next();
    machine.reset();
    any(&mut machine);
}
