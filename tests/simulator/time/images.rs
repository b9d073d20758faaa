//! The same with modules that run their flash image on the emulated microcontroller.

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use tmcm::can::Frame;
use tmcm_sim::fleet::{Fleet, Member};
use tmcm_sim::image::{ImageModule, Setup};
use tmcm_sim::{FirmwareKind, Model, WorldConfig};

use super::rig::{HOST, Paused, id, replies, sdo_read, sdo_write, telegram, tmcl_frame};
use super::slices::{Recorded, Slices, canopen_traffic, compared, tmcl_traffic};

/// Longest time that a request on USB takes: two frames, and the firmware's own time.
const USB: Nanos = 3 * MILLISECOND;
/// The silence after which a reply is expected no more, with the time until it is looked at.
const SILENCE: Nanos = 51 * MILLISECOND;

/// The ways in which time is sliced: fewer than for the core, because the emulation is slow.
const SLICES: [Slices; 2] = [Slices::Equal(MILLISECOND), Slices::Random(150 * MICROSECOND, 2)];

/// Modules that run the image of a firmware.
fn paused(firmware: FirmwareKind, modules: usize) -> Paused<ImageModule> {
    let name = match firmware {
        FirmwareKind::Tmcl => xtask::TMCL,
        FirmwareKind::Canopen => xtask::CANOPEN,
    };
    let target = xtask::programs().unwrap().join("..");
    let elf = std::fs::read(xtask::image(&target, name).unwrap().path).unwrap();
    let member = Member { model: Model::from(firmware), world: &WorldConfig::default(), eeprom: None };
    let mut usb = true;
    let fleet = Fleet::start(&vec![member; modules], 1, |Member { model, world, eeprom }, seed| {
        let setup = Setup { usb: std::mem::take(&mut usb), log: false };
        ImageModule::of(model.product(), &elf, world, eeprom, seed, setup)
    });
    Paused { fleet: fleet.unwrap() }
}

#[test]
fn a_request_on_usb_takes_as_long_as_its_reply() {
    let mut paused = paused(FirmwareKind::Tmcl, 1);
    for (count, line) in (1..).zip(["GAP 4, 0", "SAP 4, 0, 321", "GAP 250, 0", "GAP 4, 0"]) {
        let (bytes, took) = paused.exchange(line);
        assert_eq!(replies(&bytes).len(), 1, "{line}");
        assert!(took < USB, "{line}: {took}");
        assert_eq!((paused.fleet.answered(), paused.serve()), (count, 0));
    }
    let (bytes, took) = paused.exchange("STAP 4, 0");
    assert_eq!(replies(&bytes)[0].status, 100);
    assert!((5 * MILLISECOND..50 * MILLISECOND).contains(&took), "{took}");
    // Requests that come together are answered one after the other.
    let all = [telegram(1, "GAP 4, 0"), telegram(1, "SAP 4, 0, 9"), telegram(1, "GAP 4, 0")].concat();
    paused.fleet.hear_usb(HOST, &all);
    assert!(paused.serve() < 2 * USB);
    let bytes: Vec<u8> = paused.sent().into_iter().flat_map(|sent| sent.bytes).collect();
    assert_eq!(replies(&bytes).iter().map(|reply| reply.value).collect::<Vec<_>>(), [321, 9, 9]);
    assert_eq!(paused.fleet.answered(), 8);
}

#[test]
fn what_is_not_answered_takes_no_time_or_is_given_up() {
    let mut paused = paused(FirmwareKind::Tmcl, 1);
    paused.fleet.hear_usb(HOST, &telegram(1, "GAP 4, 0")[..5]);
    assert_eq!(paused.serve(), 0);
    paused.fleet.silence_usb(HOST);
    assert_eq!(paused.serve(), 0);
    // Nobody can know from outside that replies to this command are suppressed.
    paused.ok("SGP 255, 0, 1");
    let (bytes, took) = paused.exchange("MST 0");
    assert!(bytes.is_empty() && took <= SILENCE, "{took}");
    assert_eq!(paused.serve(), 0);
    let answered = paused.fleet.answered();
    assert_eq!(paused.exchange("137, 0, 0, 1234"), (vec![], 0));
    assert_eq!(paused.fleet.answered(), answered + 1);
    // It starts anew with the time that passes.
    paused.fleet.run(3 * SECOND);
    assert_eq!(paused.ok("GAP 4, 0"), 1000);
}

#[test]
fn an_event_moves_no_time() {
    paused(FirmwareKind::Tmcl, 1).event_moves_no_time();
}

#[test]
fn lines_are_answered() {
    let mut paused = paused(FirmwareKind::Tmcl, 1);
    paused.ok("139, 0, 0, 0");
    paused.fleet.hear_usb(HOST, b"AGAP 4, 0\r");
    let took = paused.serve();
    let text: Vec<u8> = paused.sent().into_iter().flat_map(|sent| sent.bytes).collect();
    assert!(text.ends_with(b"BA 100 1000\r") && took < 2 * USB, "{text:?}, {took}");
    assert_eq!(paused.fleet.answered(), 2);
}

#[test]
fn commands_are_carried_out_at_their_time() {
    let mut paused = paused(FirmwareKind::Tmcl, 1);
    paused.ok("SAP 4, 0, 321");
    paused.at(2 * MILLISECOND, "power off");
    let (bytes, took) = paused.exchange("STAP 4, 0");
    assert!(bytes.is_empty() && took <= 2 * MILLISECOND + MILLISECOND / 4, "{took}");
    assert!(!paused.control("state").unwrap().power);
    paused.control("power on");
    paused.fleet.run(SECOND);
    assert!([321, 1000].contains(&paused.ok("GAP 4, 0")));
}

#[test]
fn on_the_buses_one_of_two_answers() {
    let mut paused = paused(FirmwareKind::Tmcl, 2);
    for (count, address) in (1..).zip([1, 2, 1]) {
        let (bytes, took) = paused.exchange_rs485(address, "GAP 4, 0");
        assert_eq!(replies(&bytes).iter().map(|reply| reply.module).collect::<Vec<_>>(), [address]);
        assert!(took < 25 * MILLISECOND, "{took}");
        let (heard, took) = paused.exchange_can(tmcl_frame(address.into(), "GAP 4, 0"));
        assert_eq!((heard.len(), took < 2 * MILLISECOND), (1, true), "{took}");
        assert_eq!((paused.fleet.answered(), paused.serve()), (2 * count, 0));
    }
    let (bytes, took) = paused.exchange_rs485(9, "GAP 4, 0");
    assert!(bytes.is_empty() && took <= SILENCE + 10 * MILLISECOND, "{took}");
    let (heard, took) = paused.exchange_can(tmcl_frame(9, "GAP 4, 0"));
    assert!(heard.is_empty() && took <= SILENCE + MILLISECOND, "{took}");
}

#[test]
fn of_a_canopen_node_only_requests_take_time() {
    let mut paused = paused(FirmwareKind::Canopen, 1);
    paused.fleet.run(10 * MILLISECOND);
    paused.heard();
    let (heard, took) = paused.exchange_can(sdo_write(1, 0x1017, 0, &[1, 0]));
    assert_eq!((heard.iter().filter_map(id).collect::<Vec<_>>(), took < 2 * MILLISECOND), (vec![0x581], true));
    for (id, data) in [(0, &[1, 0][..]), (0x80, &[])] {
        assert_eq!(paused.exchange_can(Frame::standard(id, data).unwrap()).1, 0, "{id:x}");
    }
    assert!(paused.exchange_can(sdo_read(1, 0x1000, 0)).1 < 3 * MILLISECOND);
    assert_eq!(paused.serve(), 0);
    assert!(paused.exchange_can(sdo_read(9, 0x1000, 0)).1 <= SILENCE + MILLISECOND);
    let (heard, took) = paused.exchange_can(sdo_write(1, 0x1010, 1, b"save"));
    assert!(heard.iter().filter_map(id).any(|id| id == 0x581));
    assert!((5 * MILLISECOND..2 * SECOND).contains(&took), "{took}");
}

#[test]
fn slices_of_time_change_nothing() {
    let record = compared(&SLICES, |slices| {
        let mut recorded = Recorded::new(paused(FirmwareKind::Tmcl, 2), slices);
        tmcl_traffic(&mut recorded, &[2]);
        recorded.end()
    });
    assert!(record.matches("usb").count() > 6 && record.matches("rs485").count() >= 18, "{record}");
}

#[test]
fn slices_of_time_change_nothing_for_a_canopen_node() {
    let record = compared(&SLICES, |slices| {
        let mut recorded = Recorded::new(paused(FirmwareKind::Canopen, 1), slices);
        canopen_traffic(&mut recorded, 1);
        recorded.end()
    });
    assert!(record.matches("Module(0)").count() > 10, "{record}");
}
