//! The traffic on the links of a fleet: its log, and replies that are late, lost or corrupted.

use hal_sim::control::Line;
use tmcm::can::{CanFrame, Frame, Id};
use tmcm::tmcl::binary::{self, Telegram};
use tmcm_sim::{Client, FirmwareKind, Fleet, MILLISECOND, Model, Nanos, Product, SECOND, WorldConfig, text};

const ONE: Client = Client(3);
const OTHER: Client = Client(4);

fn request(address: u8, line: &str) -> Telegram {
    binary::encode_command(address, text::parse(line).unwrap())
}

fn fleet(model: impl Into<Model>, modules: usize) -> Fleet {
    let mut fleet = Fleet::of(model, &WorldConfig::default(), &vec![None; modules], 1);
    fleet.await_silences();
    fleet.log_telegrams();
    fleet
}

fn control(fleet: &mut Fleet, line: &str) {
    assert_eq!(fleet.control(&Line::parse(line).unwrap()), Ok(None), "{line}");
}

/// The log without the columns of times and bytes.
fn said(fleet: &mut Fleet) -> Vec<String> {
    let log = fleet.take_telegrams();
    log.lines().map(|line| format!("{}{}", line[14..23].trim(), &line[23..24].trim()) + line[55..].trim_end()).collect()
}

/// Lets time pass until there is a reply on the USB link for a client, or for a second; with the time it took.
fn reply(fleet: &mut Fleet, client: Client) -> Option<(Telegram, Nanos)> {
    let begun = fleet.now();
    while fleet.now() < begun + SECOND {
        fleet.run(MILLISECOND / 10);
        if let Some((0, sent)) = fleet.sent() {
            assert_eq!(sent.client, client);
            return Some((sent.telegram().unwrap(), sent.at - begun));
        }
    }
    None
}

/// The bytes on the RS485 bus within a second.
fn heard(fleet: &mut Fleet) -> Vec<u8> {
    fleet.run(SECOND);
    fleet.rs485()
}

/// The frames of modules within a second.
fn frames(fleet: &mut Fleet) -> Vec<(Nanos, Frame)> {
    fleet.run(SECOND);
    std::iter::from_fn(|| fleet.can())
        .filter(|heard| heard.from != tmcm_sim::fleet::Node::Adapter(9))
        .map(|heard| (heard.at, heard.frame))
        .collect()
}

/// All that hosts do in a scene with three links and torn, wrong and unanswered telegrams; the log of it.
fn scene() -> String {
    let mut fleet = fleet(Model::default(), 2);
    fleet.hear_usb(ONE, &request(1, "GAP 1, 0")[..4]);
    fleet.hear_usb(OTHER, &request(1, "ROR 0, 500"));
    fleet.silence_usb(ONE);
    fleet.run(20 * MILLISECOND);
    fleet.send_rs485(&request(2, "GAP 6, 0"));
    fleet.silence_rs485();
    fleet.send_can(9, Frame::standard(2, &[6, 6, 0, 0, 0, 0, 0]).unwrap());
    fleet.run(50 * MILLISECOND);
    fleet.hear_usb(ONE, &request(1, "GAP 1, 0"));
    fleet.send_rs485(&request(7, "GAP 6, 0"));
    fleet.run(30 * MILLISECOND);
    fleet.hear_usb(ONE, &request(1, "STAP 4, 0"));
    fleet.hear_usb(OTHER, &request(1, "GAP 4, 0"));
    fleet.run(SECOND);
    fleet.forget_usb(ONE);
    fleet.take_telegrams()
}

#[test]
fn two_equal_runs_have_the_same_log() {
    let log = scene();
    assert_eq!(log, scene());
    let said: Vec<&str> = log.lines().map(|line| line[55..].trim()).collect();
    for line in [
        "to 1: ROR 0, 500",
        "torn: 4 of 9 bytes",
        "from 1: 500 int, status 100 ok",
        "to 2: GAP 6, 0",
        "from 2: 128 1/255 (maximum current), status 100 ok",
        "to 7: GAP 6, 0",
        "from 1: maximum positioning speed, status 100 ok",
    ] {
        assert!(said.contains(&line), "{line} is not in\n{log}");
    }
    // Once on each bus.
    assert_eq!(said.iter().filter(|line| line.starts_with("from 2: 128")).count(), 2, "{log}");
}

#[test]
fn replies_are_lost_corrupted_and_late_on_usb() {
    let mut fleet = fleet(Product::Tmcm1140, 1);
    let gap = request(1, "GAP 6, 0");
    let ask = |fleet: &mut Fleet| {
        fleet.hear_usb(ONE, &gap);
        reply(fleet, ONE)
    };
    let (right, soon) = ask(&mut fleet).unwrap();
    control(&mut fleet, "fault reply-drop 2");
    assert_eq!((ask(&mut fleet), ask(&mut fleet)), (None, None));
    assert_eq!(ask(&mut fleet), Some((right, soon)));
    control(&mut fleet, "fault reply-corrupt 1");
    let (wrong, _) = ask(&mut fleet).unwrap();
    assert!(binary::decode_reply(&wrong).is_none() && wrong[..8] == right[..8]);
    assert_eq!(ask(&mut fleet), Some((right, soon)));
    control(&mut fleet, "fault reply-delay 20.5 ms");
    assert_eq!(ask(&mut fleet), Some((right, soon + 41 * MILLISECOND / 2)));
    assert_eq!(fleet.answered(), 5);
    fleet.take_telegrams();
    // The first comes before the second, although that is not late any more, and both before the third.
    fleet.hear_usb(ONE, &gap);
    fleet.run(2 * MILLISECOND);
    control(&mut fleet, "fault reply-delay 0");
    fleet.hear_usb(ONE, &request(1, "136, 0"));
    assert!(fleet.owes_usb(ONE) && !fleet.owes_usb(OTHER) && fleet.is_busy());
    assert_eq!(reply(&mut fleet, ONE).unwrap().0, right);
    assert_eq!(reply(&mut fleet, ONE).unwrap().0, *b"\x021140V142");
    assert!(!fleet.owes_usb(ONE));
    control(&mut fleet, "fault reply-drop 1");
    assert_eq!(ask(&mut fleet), None);
    assert_eq!(
        said(&mut fleet)[4..],
        ["usb 3>to 1: GAP 6, 0", "usb 3<lost: from 1: 128 1/255 (maximum current), status 100 ok"]
    );
    // What is late is lost with the cable, and with the power.
    control(&mut fleet, "fault reply-delay 20 ms");
    for lines in [["usb off", "usb on"], ["power off", "power on"]] {
        fleet.hear_usb(ONE, &gap);
        fleet.run(5 * MILLISECOND);
        assert!(fleet.owes_usb(ONE));
        lines.iter().for_each(|line| control(&mut fleet, line));
        assert_eq!(reply(&mut fleet, ONE), None);
    }
}

/// While time is paused it passes until a late reply is there; a lost one is not waited for.
#[test]
fn time_that_is_served_knows_of_late_replies() {
    let mut fleet = fleet(Model::default(), 1);
    let serve = |fleet: &mut Fleet| {
        let begun = fleet.now();
        fleet.hear_usb(ONE, &request(1, "GAP 6, 0"));
        while fleet.serve(Nanos::MAX) {}
        (fleet.now() - begun, fleet.sent().is_some())
    };
    let (soon, _) = serve(&mut fleet);
    control(&mut fleet, "fault reply-delay 400 ms");
    assert_eq!(serve(&mut fleet), (soon + 400 * MILLISECOND, true));
    control(&mut fleet, "fault reply-delay 0");
    control(&mut fleet, "fault reply-drop 1");
    let (passed, came) = serve(&mut fleet);
    assert!(passed < 2 * MILLISECOND && !came, "{passed}");
}

#[test]
fn events_and_echoes_pass() {
    let mut fleet = fleet(Model::default(), 1);
    for line in ["SAP 4, 0, 1000", "138, 0, 0, 1", "MVP REL, 0, 1000"] {
        fleet.hear_usb(ONE, &request(1, line));
        assert!(reply(&mut fleet, ONE).is_some());
    }
    control(&mut fleet, "fault reply-drop 1");
    let (event, _) = reply(&mut fleet, ONE).unwrap();
    assert_eq!(event[2..4], [128, 138]);
    fleet.hear_usb(ONE, &request(1, "139"));
    assert_eq!(reply(&mut fleet, ONE), None);
    control(&mut fleet, "fault reply-corrupt 1");
    fleet.hear_usb(ONE, b"AGAP 6\r");
    fleet.run(20 * MILLISECOND);
    let bytes: Vec<u8> = std::iter::from_fn(|| fleet.sent()).flat_map(|(_, sent)| sent.bytes).collect();
    let (echo, line) = bytes.split_at(7);
    assert_eq!((echo, &line[..line.len() - 2]), (&b"AGAP 6\r"[..], &b"BA 100 12"[..]));
    assert!(line.ends_with(&[!b'8', b'\r']));
}

#[test]
fn replies_are_lost_corrupted_and_late_on_rs485() {
    let mut fleet = fleet(Model::default(), 2);
    let ask = |fleet: &mut Fleet, address: u8| {
        fleet.send_rs485(&request(address, "GAP 6, 0"));
        heard(fleet)
    };
    let right = ask(&mut fleet, 2);
    assert_eq!(right.len(), 9);
    control(&mut fleet, "module 2 fault reply-drop 1");
    assert_eq!(ask(&mut fleet, 1).len(), 9);
    assert!(ask(&mut fleet, 2).is_empty());
    control(&mut fleet, "module 2 fault reply-corrupt 1");
    let wrong = ask(&mut fleet, 2);
    assert_eq!((&wrong[..8], wrong[8]), (&right[..8], !right[8]));
    fleet.take_telegrams();
    assert_eq!(ask(&mut fleet, 2), right);
    control(&mut fleet, "module 2 fault reply-delay 300 ms");
    assert_eq!(ask(&mut fleet, 2), right);
    let log = fleet.take_telegrams();
    let times: Vec<f64> = log.lines().map(|line| line[..12].trim().parse().unwrap()).collect();
    let [soon, late] = [times[1] - times[0], times[3] - times[2]];
    assert!((late - soon - 0.3).abs() < 1e-5, "{log}");
}

#[test]
fn replies_are_lost_and_late_on_the_can_bus() {
    let mut fleet = fleet(Model::default(), 2);
    let ask = |fleet: &mut Fleet, id: u16| {
        let begun = fleet.now();
        fleet.send_can(9, Frame::standard(id, &[6, 6, 0, 0, 0, 0, 0]).unwrap());
        frames(fleet).first().map(|(at, frame)| (at - begun, frame.data().to_vec()))
    };
    let (soon, right) = ask(&mut fleet, 2).unwrap();
    control(&mut fleet, "module 2 fault reply-drop 1");
    assert!(ask(&mut fleet, 1).is_some());
    assert_eq!(ask(&mut fleet, 2), None);
    // No host sees a corrupted frame.
    control(&mut fleet, "module 2 fault reply-corrupt 1");
    assert_eq!(ask(&mut fleet, 2), None);
    control(&mut fleet, "module 2 fault reply-delay 300 ms");
    assert_eq!(ask(&mut fleet, 2), Some((soon + 300 * MILLISECOND, right)));
    assert!(said(&mut fleet).contains(&"can<lost: from 2: 128 1/255 (maximum current), status 100 ok".into()));
    fleet.send_can(9, Frame::standard(2, &[6, 6, 0, 0, 0, 0, 0]).unwrap());
    fleet.run(5 * MILLISECOND);
    control(&mut fleet, "module 2 can off");
    assert!(frames(&mut fleet).is_empty());
}

#[test]
fn of_a_canopen_node_the_replies_of_the_sdo_server_are_lost_and_its_heartbeat_is_not() {
    let mut fleet = fleet(FirmwareKind::Canopen, 1);
    let write = |fleet: &mut Fleet, data: [u8; 8]| fleet.send_can(9, Frame::standard(0x601, &data).unwrap());
    write(&mut fleet, [0x2B, 0x17, 0x10, 0, 100, 0, 0, 0]);
    let heard = frames(&mut fleet);
    assert!(heard.iter().any(|(_, frame)| frame.data() == [0x60, 0x17, 0x10, 0, 0, 0, 0, 0]), "{heard:?}");
    control(&mut fleet, "fault reply-drop 1");
    write(&mut fleet, [0x40, 0x41, 0x60, 0, 0, 0, 0, 0]);
    let heard = frames(&mut fleet);
    assert!(heard.len() >= 9 && heard.iter().all(|(_, frame)| frame.data().len() == 1), "{heard:?}");
    let log = fleet.take_telegrams();
    for line in [
        "can 9    >  601 2B 17 10 00 64 00 00 00  SDO to 1: write 1017h.0 Producer heartbeat time = 100",
        "can      <  701 7F                       state of 1: pre-operational",
        "can      <  581 4B 41 60 00 50 00 00 00  lost: SDO from 1: 6041h.0 Statusword is 80",
    ] {
        assert!(log.contains(line), "{line} is not in\n{log}");
    }
}

/// A node that is off the bus says nothing there, and afterwards nothing that is out of date: its heartbeat comes ten
/// times a second again. The emergency that has come meanwhile is told, with that of the bus.
#[test]
fn a_canopen_node_off_the_bus_says_nothing() {
    let mut fleet = fleet(FirmwareKind::Canopen, 2);
    fleet.send_can(9, Frame::standard(0x602, &[0x2B, 0x17, 0x10, 0, 100, 0, 0, 0]).unwrap());
    let of_node_2 = |fleet: &mut Fleet| -> Vec<Vec<u8>> {
        let said = |frame: &Frame| matches!(frame.id(), Id::Standard(id) if id.as_raw() & 0x7F == 2);
        frames(fleet).into_iter().map(|(_, frame)| frame).filter(said).map(|frame| frame.data().to_vec()).collect()
    };
    assert!((10..=12).contains(&of_node_2(&mut fleet).len()));
    control(&mut fleet, "module 2 can off");
    control(&mut fleet, "module 2 fault overtemperature on");
    assert_eq!(of_node_2(&mut fleet), [] as [Vec<u8>; 0]);
    control(&mut fleet, "module 2 can on");
    let said = of_node_2(&mut fleet);
    let (heartbeats, others): (Vec<_>, Vec<_>) = said.iter().partition(|data| data.len() == 1);
    assert!((9..=11).contains(&heartbeats.len()), "{said:02X?}");
    // 4310h as a warning and as the end of the motion, and 8140h for the bus.
    let emergencies =
        [[0x10, 0x43, 9, 1, 0, 0, 0, 0], [0x10, 0x43, 9, 2, 0, 0, 0, 0], [0x40, 0x81, 0x19, 0, 0xFF, 0, 0, 0]];
    assert_eq!(others, emergencies.each_ref());
}
