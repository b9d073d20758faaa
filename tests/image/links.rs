//! The links and the inputs and outputs of the very flash image: what a host at the other end sees.

use common::image_host::{BAUD, Host, LOADED, OK, START, decoded, request};
use common::telegram;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::mcu::{CanBus, CanFrame};
use hal_sim::world::pin::Pin;

/// From the reply to a reset until the module answers again.
const RESET: Nanos = 100 * MILLISECOND + START;

/// Waits until the module has started anew.
fn reset(host: &mut Host) {
    host.ok("255, 0, 0, 1234");
    host.run(RESET);
}

// ---- USB ----

/// The descriptors of a serial port (CDC-ACM) with the numbers by which hosts look for the module.
#[test]
fn a_usb_host_finds_a_serial_port_of_a_tmcm_1140() {
    let mut host = Host::new("");
    host.plug_usb();
    let usb = host.machine.usb();
    let found = usb.device();
    assert_eq!(found.failed, None);
    // Length, kind; 64 bytes of packet; VID 2A3C, PID 0100, release 1.00; strings; one configuration.
    assert_eq!((&found.device[..2], found.device[7]), (&[18, 1][..], 64));
    assert_eq!(found.device[8..14], [0x3C, 0x2A, 0x00, 0x01, 0x00, 0x01]);
    assert_eq!(found.device[17], 1);
    let [manufacturer, product, serial] = found.strings.clone().map(Option::unwrap);
    assert_eq!((manufacturer.as_str(), product.as_str(), serial.len()), ("open firmware", "TMCM-1140", 24));
    let mut rest = &found.configuration[..];
    // Two interfaces, bus powered, 100 mA.
    assert_eq!((rest[4], rest[7], rest[8]), (2, 0x80, 50));
    let mut interfaces = Vec::new();
    let mut endpoints = Vec::new();
    while let [length, kind, ..] = *rest {
        match kind {
            4 => interfaces.push((rest[2], rest[5], rest[6])),
            5 => endpoints.push((rest[2] & 0x80 != 0, rest[3])),
            _ => {}
        }
        rest = &rest[usize::from(length)..];
    }
    // Communication with an abstract control model, and data; an interrupt endpoint, and a bulk endpoint each way.
    assert_eq!(interfaces, [(0, 2, 2), (1, 10, 0)]);
    endpoints.sort_unstable();
    assert_eq!(endpoints, [(false, 2), (true, 2), (true, 3)]);
}

#[test]
fn telegrams_over_usb_may_come_in_pieces_and_together() {
    let mut host = Host::new("");
    host.plug_usb();
    assert_eq!(host.ask_usb("GAP 4, 0"), (OK, 1_000));
    let whole = telegram("GAP 5, 0");
    for cut in 1..9 {
        host.machine.usb().send(&whole[..cut]);
        assert!(host.hear_usb(2 * MILLISECOND).is_empty());
        host.machine.usb().send(&whole[cut..]);
        assert_eq!(decoded("GAP 5, 0", &host.hear_usb(5 * MILLISECOND)), (OK, 1_000), "cut at {cut}");
    }
    // Fifteen telegrams are two packets and a bit; the border of a packet is within one of them.
    let lines: Vec<String> = (0..15).map(|n| format!("GGP {n}, 2")).collect();
    for (n, line) in lines.iter().enumerate() {
        assert_eq!(host.ask_usb(&line.replace("GGP", "SGP").replace(", 2", &format!(", 2, {}", 100 + n))).0, OK);
    }
    let all: Vec<u8> = lines.iter().flat_map(|line| telegram(line)).collect();
    host.machine.usb().send(&all);
    let heard = host.hear_usb(50 * MILLISECOND);
    let values: Vec<(u8, i32)> = heard.chunks(9).zip(&lines).map(|(reply, line)| decoded(line, reply)).collect();
    assert_eq!(values, (0..15).map(|n| (OK, 100 + n)).collect::<Vec<_>>());
}

// ---- ASCII mode ----

#[test]
fn ascii_mode_over_usb_and_over_rs485() {
    type Enter = fn(&mut Host, &str) -> (u8, i32);
    type Say = fn(&mut Host, &[u8]) -> String;
    let usb: Say = |host, text| {
        host.machine.usb().send(text);
        host.hear_usb(20 * MILLISECOND).escape_ascii().to_string()
    };
    // The bus is half duplex: whoever types waits for the echo of each character.
    let rs485: Say = |host, text| {
        let heard: Vec<u8> = text.iter().flat_map(|byte| host.said_to(&[*byte], 5 * MILLISECOND)).collect();
        [heard, host.said_to(&[], 50 * MILLISECOND)].concat().escape_ascii().to_string()
    };
    let mut host = Host::new("");
    host.plug_usb();
    let links: [(Enter, Say); 2] = [(Host::ask_usb, usb), (Host::ask, rs485)];
    for (enter, say) in links {
        assert_eq!(enter(&mut host, "139, 0, 0, 0"), (OK, 0));
        assert_eq!(say(&mut host, b"AGAP 4, 0\r"), "AGAP 4, 0\\rBA 100 1000\\r");
        assert_eq!(say(&mut host, b"BGAP 4, 0\r"), "", "for another module");
        assert_eq!(say(&mut host, b"AMVP ABS, 0, 10\x7F00\r"), "AMVP ABS, 0, 10\\x08 \\x0800\\rBA 100 100\\r");
        assert_eq!(say(&mut host, b"ABIN\r"), "ABIN\\rBA 100 0\\r");
    }
    assert_eq!((host.ok("GAP 0, 0"), host.ask_usb("GAP 0, 0")), (100, (OK, 100)));
    // Parameter 67, bit 0: from the start.
    host.ok("SGP 67, 0, 1");
    reset(&mut host);
    assert_eq!(rs485(&mut host, b"AGAP 4, 0\r"), "AGAP 4, 0\\rBA 100 1000\\r");
}

/// A message that ends with a full packet is followed by an empty one: without it a host may wait for more.
#[test]
fn a_message_of_a_full_packet_is_followed_by_an_empty_one() {
    let mut host = Host::new("");
    host.plug_usb();
    // Echo of the whole line, after CR, and no replies behind it.
    assert_eq!((host.ask_usb("SGP 67, 0, 16").0, host.ask_usb("139, 0, 0, 0").0), (OK, OK));
    host.said_on_can(1, "SGP 255, 0, 1", MILLISECOND);
    for length in [63, 64, 65] {
        let line = format!("ASAP 4, 0, {:0>1$}\r", 1_000, length - 12);
        assert_eq!(line.len(), length);
        host.machine.usb().send(line.as_bytes());
        assert_eq!(host.hear_usb(20 * MILLISECOND), line.as_bytes());
    }
}

// ---- CAN ----

/// Frames that are not for the module do not even wake it: it executes not one instruction more than without them.
#[test]
fn can_frames_for_others_are_not_heard() {
    let foreign = |host: &mut Host| {
        let sound = request(3, "GAP 4, 0");
        for id in (0..0x800).step_by(7).filter(|id| *id != 1) {
            host.machine.can().send(CanFrame { id, ..sound });
        }
        host.machine.can().send(CanFrame { id: 1, remote: true, ..sound });
        host.machine.can().send(CanFrame { id: 1, extended: true, ..sound });
        host.machine.can().send(CanFrame { id: 1 << 18, extended: true, ..sound });
    };
    let executed = |with: bool| {
        let mut host = Host::new("");
        let before = host.machine.counters().instructions;
        if with {
            foreign(&mut host);
        }
        host.run(100 * MILLISECOND);
        assert_eq!(host.machine.can().take_sent(), []);
        let instructions = host.machine.counters().instructions - before;
        assert_eq!(host.ask_can("GAP 4, 0"), (OK, 1_000));
        instructions
    };
    assert_eq!(executed(true), executed(false));
}

#[test]
fn can_identifiers_are_those_of_the_parameters() {
    let mut host = Host::new("");
    for line in ["SGP 71, 0, 0x123", "SGP 83, 0, 0x456", "SGP 70, 0, 0x7FF"] {
        host.ok(line);
    }
    for (id, replies) in [(0x123, 1), (0x456, 1), (1, 0), (2, 0), (0x7FF, 0)] {
        let said = host.said_on_can(id, "GAP 4, 0", 20 * MILLISECOND);
        assert_eq!(said.len(), replies, "{id:#x}: {said:?}");
        for frame in said {
            assert_eq!((frame.id, frame.length, frame.data), (0x7FF, 8, [0x23, 100, 6, 0, 0, 0x03, 0xE8, 0]));
        }
    }
    // Seven bytes are answered by seven.
    host.machine.can().send(CanFrame { length: 7, ..request(0x123, "GAP 4, 0") });
    host.run(20 * MILLISECOND);
    let [(_, frame)] = host.machine.can().take_sent()[..] else { panic!("one reply") };
    assert_eq!((frame.length, frame.data), (7, [0x23, 100, 6, 0, 0, 0x03, 0xE8, 0]));
}

/// Parameter 69, after a restart.
#[test]
fn can_at_all_bit_rates() {
    let mut host = Host::new("");
    let rates = [20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 1_000_000];
    for (value, bit_rate) in (2..).zip(rates) {
        host.ok(&format!("SGP 69, 0, {value}"));
        reset(&mut host);
        host.machine.can().set_bus(CanBus { bit_rate, ..CanBus::default() });
        assert_eq!(host.ask_can("GAP 4, 0"), (OK, 1_000), "{bit_rate} bit/s");
    }
}

// ---- RS485 ----

/// The transceiver is switched to sending before the first start bit, and back after the last stop bit. This is so soon
/// that the next module on the bus, or the host, may begin a character later.
#[test]
fn rs485_is_released_right_after_the_last_stop_bit_at_all_baud_rates() {
    let mut host = Host::new("");
    let rates = [9_600, 14_400, 19_200, 28_800, 38_400, 57_600, 76_800, 115_200, 230_400];
    for (value, baud) in rates.into_iter().enumerate() {
        host.ok(&format!("SGP 65, 0, {value}"));
        assert_eq!(host.ok("GAP 4, 0"), 1_000, "the new rate is for after the restart");
        reset(&mut host);
        host.baud = baud;
        host.machine.rs485().take_turns();
        let mut longest = 0;
        for n in 0..10 {
            host.run(n * 137 * MICROSECOND);
            let (end, reply) = host.exchange("GAP 1, 0");
            host.run(MILLISECOND);
            let [(on, true), (off, false)] = host.machine.rs485().take_turns()[..] else { panic!("{baud}") };
            let (first, last) = (reply[0].start, reply[8].end);
            assert!(on <= first && off >= last, "{baud}: {on} {first} {last} {off}");
            assert!(on >= end, "{baud}: the stop bit of the request belongs to the host: {end} {on}");
            longest = longest.max(off - last);
            let (took, ideal) = (last - first, 90 * SECOND / u64::from(baud));
            assert!(took.abs_diff(ideal) < ideal / 500, "{baud}: {took} without a gap, within 0.2 %");
        }
        println!("{baud}: released {} us after the last stop bit", longest as f64 / 1_000.0);
        assert!(longest < 10 * SECOND / u64::from(baud), "{baud}");
    }
}

/// The reply begins after the request's stop bit, whatever the core is busy with, and whatever its phase to the
/// request. It begins at once if nothing else goes on.
#[test]
fn rs485_replies_begin_when_the_stop_bit_of_the_request_is_over() {
    let mut host = Host::new("");
    host.plug_usb();
    host.ok("132, 0, 0, 0");
    for line in ["CALC ADD, 1", "GAP 1, 0", "JA 0"] {
        assert_eq!(host.ask(line).0, LOADED);
    }
    host.ok("133, 0, 0, 0");
    host.ok("SGP 77, 0, 1");
    let rates = [(0, 9_600), (5, 57_600), (7, 115_200), (8, 230_400)];
    for (value, baud) in rates {
        host.ok("128, 0, 0, 0");
        host.ok(&format!("SGP 65, 0, {value}"));
        reset(&mut host);
        host.baud = baud;
        for busy in [true, false] {
            host.ok(if busy { "129, 0, 0, 0" } else { "128, 0, 0, 0" });
            host.ok(if busy { "ROR 0, 500" } else { "MST 0" });
            let (mut soonest, mut begun) = (Nanos::MAX, Vec::new());
            for n in 0..40 {
                host.run(300 * MICROSECOND + n * 17_011);
                if busy {
                    for _ in 0..8 {
                        host.machine.can().send(request(1, "GAP 5, 0"));
                    }
                    host.machine.usb().send(&telegram("GAP 5, 0"));
                }
                host.machine.rs485().take_turns();
                let (end, reply) = host.exchange("GAP 5, 0");
                let [(on, true), ..] = host.machine.rs485().take_turns()[..] else { panic!("{baud}") };
                assert!(on >= end && reply[0].start >= on, "{baud}, busy {busy}: {end} {on} {}", reply[0].start);
                soonest = soonest.min(on - end);
                begun.push(reply[0].start - end);
            }
            begun.sort_unstable();
            let usual = begun[begun.len() / 2];
            println!("{baud}, busy {busy}: {soonest} ns after the stop bit at the soonest, as a rule {usual} ns");
            // 60 cycles, and at the highest rate, where half a stop bit is shorter than what a reply takes, 420.
            let most = if baud == 230_400 { 2_500 } else { 357 };
            assert!(busy || usual <= most, "{baud}: {usual} ns");
            host.machine.can().take_sent();
            host.machine.usb().take();
        }
    }
}

/// Parameter 75: so many milliseconds after the last byte of the request the reply begins.
#[test]
fn the_telegram_pause_is_kept() {
    let mut host = Host::new("");
    for pause in [5, 50, 255] {
        host.ok(&format!("SGP 75, 0, {pause}"));
        for n in 0..3 {
            host.run(n * 337 * MICROSECOND);
            let (end, reply) = host.exchange("GAP 4, 0");
            let silence = reply[0].start - end;
            // The last byte is there half a bit before its end; the pause is looked at each millisecond.
            let shortest = pause * MILLISECOND - SECOND / u64::from(BAUD) / 2;
            assert!((shortest..=shortest + 1_200 * MICROSECOND).contains(&silence), "{pause}: {silence}");
        }
    }
}

/// Whatever becomes due while a reply is on its way, its last byte included, is sent behind it.
#[test]
fn an_event_that_comes_while_a_reply_goes_out_follows_it() {
    let mut host = Host::new("");
    for line in ["SAP 4, 0, 2000", "SAP 5, 0, 2000", "138, 1, 0, 1"] {
        host.ok(line);
    }
    for steps in (5..60).step_by(5) {
        let said = host.said_to(&telegram(&format!("MVP REL, 0, {steps}")), 100 * MILLISECOND);
        assert_eq!(said.len(), 18, "{steps} steps: {said:?}");
        assert_eq!((said[2], said[3], said[11], said[12]), (OK, 4, 128, 138), "{steps} steps");
    }
}

/// As many replies come as there were requests, however close together the requests are, and the event comes behind its
/// reply. The controller must have room for all of them: for three to be read and three to be sent.
#[test]
fn all_requests_over_can_are_answered() {
    for (value, bit_rate) in [(8, 1_000_000), (7, 500_000), (2, 20_000)] {
        let mut host = Host::new("");
        host.ok(&format!("SGP 69, 0, {value}"));
        reset(&mut host);
        host.machine.can().set_bus(CanBus { bit_rate, ..CanBus::default() });
        for number in [1, 2, 3, 5, 6] {
            for _ in 0..number {
                host.machine.can().send(request(1, "GAP 4, 0"));
            }
            host.run(number * 20 * MILLISECOND);
            assert_eq!(host.machine.can().take_sent().len() as u64, number, "{bit_rate} bit/s");
        }
        assert_eq!(host.ask_can("138, 1, 0, 1").0, OK);
        let position = host.ask_can("GAP 1, 0").1;
        for _ in 0..20 {
            host.run(317 * MICROSECOND);
            let said = host.said_on_can(1, &format!("MVP ABS, 0, {position}"), 20 * MILLISECOND);
            let told: Vec<(u8, u8)> = said.iter().map(|frame| (frame.data[1], frame.data[2])).collect();
            assert_eq!(told, [(OK, 4), (128, 138)], "{bit_rate} bit/s");
        }
    }
}

/// A host that sends on and on does not let the module speak: three replies wait in the controller, and the event that
/// comes meanwhile is sent behind them.
#[test]
fn an_event_that_comes_while_three_replies_wait_on_can_is_sent_behind_them() {
    let mut host = Host::new("");
    host.ok("SGP 69, 0, 5");
    reset(&mut host);
    host.machine.can().set_bus(CanBus { bit_rate: 125_000, ..CanBus::default() });
    for _ in 0..3 {
        assert_eq!(host.ask_can("138, 1, 0, 1").0, OK);
        host.machine.can().send(request(1, "MVP REL, 0, 20"));
        for _ in 0..40 {
            host.machine.can().send(request(1, "GAP 4, 0"));
        }
        host.run(100 * MILLISECOND);
        let told: Vec<(u8, u8)> = host.machine.can().take_sent().iter().map(|(_, f)| (f.data[1], f.data[2])).collect();
        // What the controller has no room for is lost, but nothing that was read.
        let event = told.iter().position(|told| *told == (128, 138));
        assert!(event.is_some_and(|place| place >= 3), "{told:?}");
        assert_eq!(told.iter().filter(|told| **told == (OK, 4)).count(), 1, "{told:?}");
        assert_eq!(host.ask_can("GAP 4, 0"), (OK, 1_000));
    }
}

// ---- Heartbeats ----

/// Parameters 68 and 82: the motor stops when its host falls silent.
#[test]
fn a_silent_host_stops_the_motor() {
    type Link = fn(&mut Host, &str) -> (u8, i32);
    let links: [(u8, Link); 3] = [(68, Host::ask), (68, Host::ask_usb), (82, Host::ask_can)];
    let mut host = Host::new("");
    host.plug_usb();
    for (parameter, ask) in links {
        for line in [format!("SGP {parameter}, 0, 200"), "ROR 0, 500".into()] {
            assert_eq!(ask(&mut host, &line).0, OK);
        }
        for _ in 0..5 {
            host.run(150 * MILLISECOND);
            assert_eq!((ask(&mut host, "GAP 2, 0"), host.speed()), ((OK, 500), 500));
        }
        host.run(260 * MILLISECOND);
        host.assert_rest();
        assert_eq!(ask(&mut host, &format!("SGP {parameter}, 0, 0")).0, OK);
    }
}

// ---- Inputs and outputs ----

#[test]
fn the_external_encoder_is_counted_and_cleared_at_its_null() {
    // 8 000 counts a turn of 51 200 microsteps; 3264 / 512 = 6.375 microsteps a count.
    let mut host = Host::new("[abn]\nlines = 2000\nindex = 10000");
    // Within two counts.
    let near = |got: i32, expected: i32| assert!((got - expected).abs() <= 13, "{got} in place of {expected}");
    let go = |host: &mut Host, target: i32| {
        host.ok(&format!("MVP ABS, 0, {target}"));
        host.wait(20 * MILLISECOND, 5 * SECOND, |host| host.rotor() == i64::from(target));
        host.run(5 * MILLISECOND);
        host.ok("GAP 216, 0")
    };
    let counted = |steps: i32| steps * 255 / 256;
    host.ok("SAP 4, 0, 2047");
    host.ok("SAP 217, 0, 3264");
    host.ok("SAP 216, 0, 0");
    near(go(&mut host, 5_000), counted(5_000));
    near(go(&mut host, -5_000), counted(-5_000));
    // Zeroed at full speed each time its null track rises, which is the edge bit 4 chooses, or each time it falls. That
    // is one count further on, whichever way it goes.
    let [rising, falling] = [16, 0].map(|edge| {
        let bits = 3264 + 4 + 8 + edge;
        host.ok(&format!("SAP 217, 0, {bits}"));
        [40_000, 0].map(|target| go(&mut host, target))
    });
    for ((rising, falling), steps) in rising.into_iter().zip(falling).zip([30_000, -10_000]) {
        near(rising, counted(steps));
        let count = (rising - falling) * steps.signum();
        assert!((6..=7).contains(&count), "{steps}: {rising}, and {falling} from the other edge");
    }
}

#[test]
fn analog_values_supply_and_temperature_are_measured() {
    let mut host = Host::new("");
    for (analog, volts, celsius) in [(0, 24.0, 25), (1_234, 12.3, 85), (4_095, 33.0, -20)] {
        host.machine.board().change_world(|world| {
            world.set_analog(0, analog);
            world.set_supply(volts);
            world.set_temperature(celsius);
        });
        host.run(20 * MILLISECOND);
        assert_eq!(host.ok("GIO 0, 1"), i32::from(analog));
        // 36.3 V and 4096 steps; 0.8 mV a step and 2.5 mV a degree.
        let (supply, temperature) = (host.ok("GIO 8, 1"), host.ok("GIO 9, 1"));
        assert!((f64::from(supply) - 10.0 * volts).abs() <= 1.0, "{volts} V: {supply}");
        assert!((temperature - celsius).abs() <= 1, "{celsius}: {temperature}");
        assert_eq!(host.ok("GIO 0, 0"), i32::from(analog >= 2_048));
    }
}

#[test]
fn inputs_outputs_and_pull_ups_are_at_their_pins() {
    let mut host = Host::new("");
    for (pin, port) in [(Pin::Left, 1), (Pin::Right, 2), (Pin::Home, 3)] {
        for on in [true, false] {
            host.machine.board().change_world(|world| world.axis_mut(0).press(pin, on));
            host.run(2 * MILLISECOND);
            let levels = [1, 2, 3].map(|n| host.ok(&format!("GIO {n}, 0")));
            assert_eq!(levels, [1, 2, 3].map(|n| i32::from(on && n == port)));
        }
    }
    for bits in [1, 2, 3, 0] {
        host.ok(&format!("SIO 255, 2, {bits}"));
        host.run(2 * MILLISECOND);
        let outputs = host.machine.board().world().outputs();
        assert_eq!(outputs.digital, bits);
        assert_eq!(outputs.pull_ups, 1);
    }
    for on in [0, 1] {
        host.ok(&format!("SIO 0, 0, {on}"));
        host.run(2 * MILLISECOND);
        assert_eq!(host.machine.board().world().outputs().pull_ups, on);
    }
}

/// LED1 is lit for the first second and changes each second; LED2 is for trouble, and there is none.
#[test]
fn the_led_blinks_while_the_firmware_runs() {
    let mut host = Host::new("");
    let mut changes = Vec::new();
    let mut lit = true;
    while host.machine.now() < 3_200 * MILLISECOND {
        host.run(10 * MILLISECOND);
        let leds = host.machine.board().world().outputs().leds;
        assert!(!leds[1]);
        if leds[0] != lit {
            lit = leds[0];
            changes.push(host.machine.now() / (10 * MILLISECOND) * 10);
        }
    }
    assert!(changes.len() == 3 && changes.windows(2).all(|pair| pair[1] - pair[0] == 1_000), "{changes:?}");
}

/// The two pads, connected while the module is switched on, bring the factory settings back.
#[test]
fn the_pads_bring_back_the_factory_settings() {
    let mut host = Host::new("");
    let cycle = |host: &mut Host, connected: bool| {
        host.machine.set_power(false);
        host.machine.wiring().connect_pads(connected);
        host.run(10 * MILLISECOND);
        host.machine.set_power(true);
        host.run(2 * START);
        host.log()
    };
    host.ok("SAP 4, 0, 1234");
    host.ok("STAP 4, 0");
    host.ok("SGP 66, 0, 1");
    host.ok("SGP 87, 0, 9");
    assert!(!cycle(&mut host, false).iter().any(|line| line.contains("pads")));
    assert_eq!((host.ok("GAP 4, 0"), host.ok("GGP 87, 0")), (1_234, 9));
    assert!(cycle(&mut host, true).iter().any(|line| line == "warn: pads connected: factory settings"));
    assert_eq!((host.ok("GAP 4, 0"), host.ok("GGP 87, 0")), (1_000, 0));
    cycle(&mut host, false);
    assert_eq!((host.ok("GAP 4, 0"), host.ok("GGP 87, 0")), (1_000, 0), "for good");
}
