//! Command 138: what tells a host that a move has arrived, or that a reference search has found its place.

use common::{Bench, OK, WRONG_TYPE};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::module::Source;

/// The replies that come by themselves: status, number of the command, value.
fn events(bench: &mut Bench) -> Vec<(u8, u8, i32)> {
    bench.listen(5 * SECOND).iter().map(|event| (event.status, event.opcode, event.value)).collect()
}

/// The event that the module sends when motor 0 has arrived.
const ARRIVED: [(u8, u8, i32); 1] = [(128, 138, 1)];
const NOTHING: [(u8, u8, i32); 0] = [];

#[test]
fn event_for_the_next_move_only() {
    let mut bench = Bench::new();
    assert_eq!(bench.ok("138, 0, 0, 1"), 1);
    assert_eq!(events(&mut bench), NOTHING);
    bench.ok("MVP ABS, 0, 20000");
    assert_eq!(events(&mut bench), ARRIVED);
    bench.ok("MVP ABS, 0, 0");
    assert_eq!(events(&mut bench), NOTHING);
}

#[test]
fn event_for_every_move() {
    let mut bench = Bench::new();
    bench.ok("138, 1, 0, 1");
    for line in ["MVP ABS, 0, 20000", "MVP REL, 0, -300", "MVP COORD, 0, 1"] {
        bench.ok(line);
        assert_eq!(events(&mut bench), ARRIVED, "{line}");
    }
    // An empty mask ends it.
    bench.ok("138, 1, 0, 0");
    bench.ok("MVP ABS, 0, 1000");
    assert_eq!(events(&mut bench), NOTHING);
}

/// The event comes when the motor is there, and to the link that asked, after the reply to MVP.
#[test]
fn the_event_comes_on_arrival_over_the_link_that_asked() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask_over(Source::Rs485, 1, "138, 0, 0, 1").map(|reply| reply.status), Some(OK));
    bench.ok("MVP ABS, 0, 20000");
    let event = loop {
        bench.run(MILLISECOND);
        match bench.module.sent() {
            Some(sent) => break sent,
            None => assert_ne!(bench.rotor(), 20_000, "it is there and does not say so"),
        }
    };
    assert_eq!((bench.rotor(), event.source), (20_000, Source::Rs485));
    assert_eq!(event.bytes, [2, 1, 128, 138, 0, 0, 0, 1, 0x0E]);
}

/// First the reply to MVP, then the event.
#[test]
fn a_move_of_no_distance_arrives_too() {
    let mut bench = Bench::new();
    bench.ok("138, 1, 0, 1");
    for line in ["MVP REL, 0, 0", "MVP ABS, 0, 0", "MVP COORD, 255, 1"] {
        let reply = bench.ask_over(Source::Rs485, 1, line).unwrap();
        assert_eq!((reply.status, reply.value), (OK, 0), "{line}");
        assert_eq!(events(&mut bench), ARRIVED, "{line}");
    }
}

#[test]
fn no_event_after_an_interrupted_move() {
    for interruption in ["MST 0", "ROR 0, 100", "SAP 138, 0, 2", "SAP 1, 0, 0"] {
        let mut bench = Bench::new();
        bench.ok("138, 0, 0, 1");
        bench.ok("MVP ABS, 0, 30000");
        bench.run(SECOND / 4);
        bench.ok(interruption);
        bench.run(SECOND);
        bench.ok("SAP 0, 0, 30000");
        assert_eq!(events(&mut bench), NOTHING, "{interruption}");
        // That was the next MVP; the one after it is none of the host's concern.
        bench.ok("MVP ABS, 0, 0");
        assert_eq!(events(&mut bench), NOTHING, "{interruption}");
    }
}

/// In positioning modes parameter 2 has no effect at all, so the move goes on and arrives.
#[test]
fn an_event_in_spite_of_a_target_speed_in_between() {
    for speed in [0, 100] {
        let mut bench = Bench::new();
        bench.ok("138, 0, 0, 1");
        bench.ok("MVP ABS, 0, 30000");
        bench.run(SECOND / 4);
        bench.ok(&format!("SAP 2, 0, {speed}"));
        assert_eq!(events(&mut bench), ARRIVED);
        assert_eq!(bench.rotor(), 30_000);
    }
}

/// Nor when a stall came in between, in a move or a reference search: the next move is none of the host's concern.
#[test]
fn no_event_after_a_stall() {
    for start in ["MVP ABS, 0, 300000", "RFS START, 0"] {
        let mut bench = Bench::new();
        for line in ["SAP 174, 0, 1", "SAP 194, 0, 1000", "SAP 195, 0, 1000", "138, 0, 0, 1", start] {
            bench.ok(line);
        }
        bench.run(SECOND);
        bench.ok("SAP 181, 0, 700");
        bench.control("load 1");
        bench.run(SECOND);
        assert_eq!((bench.ok("GAP 3, 0"), bench.ok("RFS STATUS, 0")), (0, 0), "{start}");
        bench.control("load 0");
        for line in ["SAP 181, 0, 0", "MVP ABS, 0, 0"] {
            bench.ok(line);
        }
        assert_eq!(events(&mut bench), NOTHING, "{start}");
    }
}

/// A stage on which the search of mode 1 finds its place: the middle of the left switch's edge.
const LEFT_SWITCH: &str = "[stage]\nleft = -20000\n";

/// A reference search that has found its place sends one event, at its end and none at its legs; it uses up type 0.
#[test]
fn event_of_a_reference_search() {
    for kind in [0, 1] {
        let mut bench = Bench::in_world(LEFT_SWITCH);
        bench.ok(&format!("138, {kind}, 0, 1"));
        bench.ok("RFS START, 0");
        let mut said = Vec::new();
        bench.run_until(30 * SECOND, |b| {
            said.extend(std::iter::from_fn(|| b.module.sent()).filter_map(|sent| sent.telegram()));
            b.ok("RFS STATUS, 0") == 0
        });
        said.extend(std::iter::from_fn(|| bench.module.sent()).filter_map(|sent| sent.telegram()));
        let event = [2, 1, 128, 138, 0, 0, 0, 1, 0x0E];
        assert_eq!(said, [event], "type {kind}");
        bench.ok("MVP ABS, 0, 500");
        assert_eq!(events(&mut bench), &ARRIVED[..kind], "the next move, type {kind}");
    }
}

/// A search that takes the place of a move is what the host waits for then, unless the move has used up type 0.
#[test]
fn a_search_takes_the_place_of_a_move() {
    for kind in [0, 1] {
        let mut bench = Bench::in_world(LEFT_SWITCH);
        for line in [&format!("138, {kind}, 0, 1"), "MVP ABS, 0, 30000", "RFS START, 0"] {
            bench.ok(line);
        }
        bench.module.run(20 * SECOND);
        assert_eq!(events(&mut bench), &ARRIVED[..kind], "type {kind}");
        assert_eq!(bench.ok("RFS STATUS, 0"), 0);
    }
}

/// A search that was stopped, gave way to something else, or found no place for its legs sends nothing.
#[test]
fn no_event_after_a_search_that_did_not_find_its_place() {
    for interruption in
        ["RFS STOP, 0", "MST 0", "ROR 0, 100", "SAP 2, 0, 0", "SAP 2, 0, 100", "SAP 138, 0, 0", "SAP 1, 0, 0"]
    {
        let mut bench = Bench::in_world(LEFT_SWITCH);
        bench.ok("138, 0, 0, 1");
        bench.ok("RFS START, 0");
        bench.run(SECOND / 4);
        bench.ok(interruption);
        bench.run(SECOND);
        assert_eq!((bench.ok("RFS STATUS, 0"), events(&mut bench)), (0, vec![]), "{interruption}");
        // The move that ends a search is the next one, and none of the host's concern.
        bench.ok("MVP ABS, 0, 100");
        assert_eq!(events(&mut bench), NOTHING, "{interruption}");
    }
    // Mode 5 finds neither a home switch nor a way past the second end.
    let mut bench = Bench::in_world("[stage]\nleft = -20000\nright = 20000\n");
    for line in ["SAP 193, 0, 5", "138, 1, 0, 1", "RFS START, 0"] {
        bench.ok(line);
    }
    assert_eq!((events(&mut bench), bench.ok("RFS STATUS, 0")), (vec![], 0));
    // A move that ends a search is told of by type 1, when it arrives.
    for (kind, said) in [(0, &[][..]), (1, &ARRIVED[..])] {
        let mut bench = Bench::in_world(LEFT_SWITCH);
        for line in [&format!("138, {kind}, 0, 1"), "RFS START, 0", "MVP ABS, 0, 1000"] {
            bench.ok(line);
        }
        assert_eq!(events(&mut bench), said, "type {kind}");
    }
}

/// RFS STOP without a search does nothing, and a search that is refused neither: the move under way arrives.
#[test]
fn an_event_in_spite_of_rfs_without_a_search() {
    for line in ["RFS STOP, 0", "RFS STATUS, 0", "RFS START, 0"] {
        let mut bench = Bench::new();
        bench.ok("138, 0, 0, 1");
        // RFS START refuses a speed of 0.
        bench.ok("SAP 194, 0, 0");
        bench.ok("MVP ABS, 0, 30000");
        bench.run(SECOND / 4);
        bench.ask(line);
        assert_eq!(events(&mut bench), ARRIVED, "{line}");
    }
}

/// A stop switch ends the move: it has not arrived, then or later.
#[test]
fn no_event_at_a_stop_switch() {
    let mut bench = Bench::in_world("[stage]\nright = 10000\n");
    bench.ok("SAP 12, 0, 0");
    bench.ok("138, 0, 0, 1");
    bench.ok("MVP ABS, 0, 30000");
    assert_eq!(events(&mut bench), NOTHING);
    bench.ok("MVP ABS, 0, 0");
    assert_eq!(events(&mut bench), NOTHING);
    assert_eq!(bench.rotor(), 0);
}

/// A switch that held the motor only before the move, for some milliseconds, or within the tolerance of parameter 141
/// does not end it: the event comes.
#[test]
fn an_event_in_spite_of_a_switch_that_does_not_hold() {
    for phase in 0..8 {
        let mut bench = Bench::new();
        bench.ok("SAP 12, 0, 0");
        bench.ok("138, 1, 0, 1");
        bench.control("press right");
        bench.run((20 + phase) * MILLISECOND);
        bench.control("release right");
        bench.ok("MVP ABS, 0, 2000");
        assert_eq!(events(&mut bench), ARRIVED, "released before, phase {phase}");
        bench.control("press right");
        bench.ok("MVP ABS, 0, 4000");
        bench.run((5 + phase) * MILLISECOND);
        bench.control("release right");
        assert_eq!(events(&mut bench), ARRIVED, "released soon after, phase {phase}");
    }
    let mut bench = Bench::new();
    for line in ["SAP 13, 0, 0", "SAP 141, 0, 4000", "SAP 5, 0, 10", "138, 1, 0, 1"] {
        bench.ok(line);
    }
    bench.control("press left");
    bench.run(20 * MILLISECOND);
    bench.ok("MVP ABS, 0, -2000");
    assert_eq!(events(&mut bench), ARRIVED, "within the tolerance");
}

/// A new target on the way: the event comes once, at the last one.
#[test]
fn one_event_for_a_target_changed_on_the_way() {
    let mut bench = Bench::new();
    bench.ok("138, 1, 0, 1");
    bench.ok("MVP ABS, 0, 30000");
    bench.run(SECOND / 4);
    bench.ok("MVP ABS, 0, 2000");
    assert_eq!(events(&mut bench), ARRIVED);
    assert_eq!(bench.rotor(), 2000);
}

#[test]
fn event_refusals() {
    let mut bench = Bench::new();
    bench.ok("138, 1, 0, 1");
    for (line, status) in [("138, 2, 0, 1", WRONG_TYPE), ("138, 255, 0, 0", WRONG_TYPE)] {
        bench.refused(line, status);
    }
    // What was asked for before still holds.
    bench.ok("MVP ABS, 0, 500");
    assert_eq!(events(&mut bench), ARRIVED);
}

/// Any mask is taken and echoed; hosts ask for eight axes of a module that has one. Only the bits of its axes count.
#[test]
fn event_masks_with_bits_of_axes_that_do_not_exist() {
    for (mask, said) in [(255, &ARRIVED[..]), (-1, &ARRIVED), (i32::MIN, &[]), (254, &[])] {
        for kind in [0, 1] {
            let mut bench = Bench::new();
            assert_eq!(bench.ok(&format!("138, {kind}, 0, {mask}")), mask);
            bench.ok("MVP ABS, 0, 500");
            assert_eq!(events(&mut bench), said, "type {kind}, mask {mask}");
        }
    }
}
