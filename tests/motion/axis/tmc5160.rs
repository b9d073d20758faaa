//! A TMC5160 to the turn: when what was read of it is younger than what it was told.

use common::Bench;
use hal_sim::clock::SECOND;
use tmcm::tmcl::Command;
use tmcm_sim::Product;

/// Registers of the chip.
const GCONF: u8 = 0x00;
const SW_MODE: u8 = 0x34;
/// Polls in which all readings have come.
const ROTATION: usize = 32;

fn register(bench: &Bench, address: u8) -> u32 {
    bench.module.board().borrow().tmc5160(0).register(address)
}

/// The number of polls until something is true, if it is in less than a hundred.
fn polls_until(bench: &mut Bench, done: impl Fn(&mut Bench) -> bool) -> Option<usize> {
    (1..100).find(|_| {
        bench.poll(1);
        done(bench)
    })
}

/// The speed is asked for in one of two turns and comes in the next one. So four turns after a motion command it is
/// known that a motor stands: then stealthChop can be switched on.
#[test]
fn a_motor_is_known_to_stand_in_the_fourth_turn_after_a_command() {
    for phase in 0..ROTATION {
        let mut bench = Bench::of(Product::Tmcm3212);
        bench.configure(&["SAP 187, 0, 15", "MVP ABS, 0, 1000"]);
        bench.run(3 * SECOND);
        bench.poll(phase);
        bench.tell("MVP ABS, 0, 1000");
        bench.tell("SAP 186, 0, 100000");
        assert_eq!(register(&bench, GCONF) & 4, 0);
        assert_eq!(polls_until(&mut bench, |bench| register(bench, GCONF) & 4 != 0), Some(4), "phase {phase}");
    }
}

/// A motor is stopped at once by the switches, both of which count as closed for two turns: the ramp generator has seen
/// them then. The low supply is seen at the beginning of a turn, whose poll is the first of the two.
#[test]
fn a_motor_that_was_stopped_at_once_has_its_switches_again_after_two_turns() {
    for phase in 0..ROTATION {
        let mut bench = Bench::of(Product::Tmcm3212);
        bench.ok("ROR 0, 30000");
        bench.run(SECOND);
        bench.poll(phase);
        bench.control("supply 8");
        let usual = register(&bench, SW_MODE);
        assert!(polls_until(&mut bench, |bench| register(bench, SW_MODE) != usual).is_some());
        assert_eq!(polls_until(&mut bench, |bench| register(bench, SW_MODE) == usual), Some(1), "phase {phase}");
    }
}

/// The driver's flags are asked for in one of four turns and come in the next one. So the shut-down that the next
/// command has ended counts again in the sixth turn after it, if its cause is still there, whatever was read in
/// between.
#[test]
fn a_short_circuit_that_lasts_counts_in_the_sixth_turn_after_a_command() {
    for phase in 0..ROTATION {
        let mut bench = Bench::of(Product::Tmcm3212);
        bench.ok("ROR 0, 30000");
        bench.run(SECOND);
        bench.control("fault short-a on");
        bench.run(SECOND);
        bench.poll(phase);
        let shows = |bench: &mut Bench| bench.module.read(Command::new(6, 208, 0, 0)).unwrap() & 1 << 3 != 0;
        assert!(shows(&mut bench));
        bench.tell("ROR 0, 30000");
        assert!(!shows(&mut bench));
        assert_eq!(polls_until(&mut bench, shows), Some(6), "phase {phase}");
    }
}
