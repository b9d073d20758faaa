//! The drivers of chips.

use core::hint::black_box as any;

use super::stand_ins::Chip;
use tmcm::chip::at25::At25;
use tmcm::chip::encoder::Counter;
use tmcm::chip::tmc262::{Configuration, Tmc262};
use tmcm::chip::tmc429::{RampGenerator, Register, Tmc429, signed};
use tmcm::chip::tmc5160::{self, Tmc5160};
use tmcm::units::CurrentScale;

#[inline(never)]
pub(super) fn chips() {
    let mut controller = Tmc429::new(Chip);
    any(&mut controller);
    let (generator, register) = (any(RampGenerator::First), any(Register::XTarget));
    let _ = any(controller.halt());
    let _ = any(controller.initialise());
    let _ = any(controller.write_interface(any(true), any(true)));
    let _ = any(controller.write(generator, register, any(0)));
    let _ = any(controller.place_standing(generator, any(0)));
    any(controller.holds(generator, register, any(0)));
    let _ = any(controller.read(generator, register));
    let _ = any(controller.reference_switches());
    controller.forget_switches();
    let _ = any(controller.switches_once());
    let _ = any(controller.confirm());
    any(controller.left_switch(generator));
    any(signed(any(0), any(0)));

    let mut driver = Tmc262::new(Chip);
    any(&mut driver);
    let _ = any(driver.refresh());
    driver.forget();
    driver.configure(&any(CONFIGURATION));
    let _ = any(driver.update());
    driver.note_silence();
    any((driver.load(), driver.current(), driver.flags()));

    let mut chip = Tmc5160::new(Chip);
    any(&mut chip);
    let register = any(tmc5160::Register::XTarget);
    let _ = any(chip.initialise());
    let _ = any(chip.halt());
    let _ = any(chip.write(register, any(0)));
    let _ = any(chip.place_standing(register, any(0)));
    any(chip.holds(register, any(0)));
    chip.forget();
    chip.drop_reading();
    let _ = any(chip.read(register));
    let _ = any(chip.turn(register));
    let _ = any(chip.confirm());
    any((chip.answers(), chip.is_lost(), chip.switches(), chip.is_stalled()));

    let mut memory = At25::new(Chip);
    any(&mut memory);
    let _ = any(memory.settle());
    let _ = any(memory.busy());
    let _ = any(memory.read(any(0), any(&mut [])));
    let _ = any(memory.start_write(any(0), any(&[])));

    let mut counter = Counter::<1024>::new();
    any(&mut counter);
    any(counter.update(any(0), any(0), any(true)));
    counter.zero_at(any(0), any(0), any(true));
    counter.set(any(0));
    any(counter.position());
}

const CONFIGURATION: Configuration = Configuration {
    microsteps: 0,
    interpolation: false,
    double_edge: false,
    blank_time: 0,
    constant_toff: false,
    no_fast_decay_comparator: false,
    hysteresis_decrement: 0,
    hysteresis_end: 0,
    hysteresis_start: 0,
    off_time: 0,
    random_off_time: false,
    current_minimum: 0,
    down_step: 0,
    hysteresis: 0,
    up_step: 0,
    cool_step: 0,
    filter: false,
    threshold: 0,
    current: CurrentScale::from_parameter(0),
    slope_high: 0,
    slope_low: 0,
    no_short_protection: false,
    short_timer: 0,
    vsense: false,
};
