//! The core at its own two doors, without the simulator's scheduler: polls that come late, and replies that are fetched
//! late.

use std::iter;
use std::task::Poll;

use hal_sim::board::{Board, SharedBoard};
use hal_sim::clock::MICROSECOND;
use hal_sim::world::config::WorldConfig;
use tmcm::can::Frame;
use tmcm::device::Inputs;
use tmcm::module::{Answer, Due, Module, Request, Source};
use tmcm::tmcl::{Reply, Status, binary, can, text};
use tmcm::units::Micros;
use tmcm_sim::native::{Simulated, parts};

const CAN: Source = Source::Can;

struct Core {
    board: SharedBoard,
    module: Module<Simulated<()>, 1>,
}

impl Core {
    fn new() -> Self {
        let board = SharedBoard::new(Board::new(&WorldConfig::default(), 1));
        let mut module = Module::new(parts(&board), (), 1);
        module.start(Micros(0), |_| {});
        let mut core = Core { board, module };
        core.poll(0);
        core
    }

    fn now(&self) -> Micros {
        Micros(self.board.borrow().now() / MICROSECOND)
    }

    /// Lets time pass until `at`, in microseconds, without a poll, and then does all that is due.
    fn poll(&mut self, at: u64) {
        self.board.borrow_mut().advance_to(at * MICROSECOND);
        while self.module.deadline() <= self.now() {
            self.module.poll(self.now(), &Inputs { supply: Some(240), ..Inputs::default() });
        }
    }

    /// Polls whenever the core asks for it, until `at`; how often that was.
    fn poll_in_time(&mut self, at: u64) -> u32 {
        let mut polls = 0;
        while self.module.deadline().0 <= at {
            self.poll(self.module.deadline().0.max(self.now().0));
            polls += 1;
        }
        polls
    }

    fn execute(&mut self, source: Source, line: &str) -> Answer {
        self.module.execute(self.now(), source, text::parse(line).unwrap())
    }

    fn ok(&mut self, line: &str) -> i32 {
        match self.execute(Source::Usb, line) {
            Poll::Ready(Some(Reply::Plain { status: Status::Ok | Status::Loaded, value, .. })) => value,
            Poll::Pending => {
                self.store();
                let Due { reply: Some(reply), .. } = self.module.next_reply().unwrap() else { panic!("{line}") };
                let Reply::Plain { status: Status::Ok, value, .. } = reply else { panic!("{line}: {reply:?}") };
                value
            }
            other => panic!("{line}: {other:?}"),
        }
    }

    /// All that is to be stored is durable.
    fn store(&mut self) {
        while self.module.store().next_job().is_some() {
            self.module.stored(true);
        }
    }
}

/// From a poll that was late the next one is counted anew: what was missed is not made up for.
#[test]
fn late_polls_do_not_bunch_up() {
    let mut core = Core::new();
    for late in [1_001, 1_999, 2_000, 10_300, 1_000_000] {
        let at = core.now().0 + late;
        core.poll(at);
        let next = core.module.deadline().0;
        assert!(next > at && next <= at + 1_000, "{late} us after the one before: {}", next - at);
        let begin = core.now().0;
        assert!((49..=50).contains(&core.poll_in_time(begin + 50_000)), "{late}");
    }
    // What is a little late keeps the beat.
    let beat = core.module.deadline().0;
    for n in 0..10 {
        core.poll(beat + n * 1_000 + n * 90);
        assert_eq!(core.module.deadline().0, beat + (n + 1) * 1_000);
    }
}

/// A timer whose periods a late poll has missed calls its handler once, and then a period later.
#[test]
fn a_timer_after_a_late_poll() {
    let mut core = Core::new();
    for line in [
        "132, 0, 0, 0",
        "JA 0",
        "GGP 0, 2",
        "CALC ADD, 1",
        "AGP 0, 2",
        "RETI",
        "133",
        "SGP 0, 3, 5",
        "VECT 0, 1",
        "EI 0",
        "EI 255",
        "129, 1",
    ] {
        core.ok(line);
    }
    core.poll_in_time(1_500);
    core.poll_in_time(22_500);
    let before = core.ok("GGP 0, 2");
    assert_eq!(before, 4);
    // Four more are due until then, and one a moment later.
    core.poll(44_900);
    core.poll_in_time(47_000);
    assert_eq!(core.ok("GGP 0, 2"), before + 1, "once for all that were missed");
    core.poll_in_time(49_500);
    assert_eq!(core.ok("GGP 0, 2"), before + 1, "the rhythm begins anew");
    core.poll_in_time(51_500);
    assert_eq!(core.ok("GGP 0, 2"), before + 2);
    core.poll_in_time(71_500);
    assert_eq!(core.ok("GGP 0, 2"), before + 6);
}

/// Replies that wait to be fetched go out under the settings that were in force when they became due, whoever sends
/// something in between.
#[test]
fn links_change_when_no_reply_waits_any_more() {
    for setting in
        ["SGP 66, 0, 90", "SGP 70, 0, 900", "SGP 71, 0, 900", "SGP 76, 0, 90", "SGP 83, 0, 900", "SGP 87, 0, 90"]
    {
        let mut core = Core::new();
        let before = *core.module.link_settings();
        for (source, line) in [(CAN, "SGP 77, 0, 1"), (Source::Rs485, "SGP 85, 0, 1"), (Source::Usb, setting)] {
            assert_eq!(core.execute(source, line), Poll::Pending);
        }
        let bystander = |core: &mut Core| {
            let command = text::parse("GGP 128, 0").unwrap();
            let telegram = Request::Telegram(binary::decode(&binary::encode_command(33, command)));
            let frame =
                Request::Frame(can::decode(&Frame::standard(33, &can::encode_command(command)).unwrap()).unwrap());
            assert_eq!(core.module.request(core.now(), Source::Rs485, &telegram).0, Poll::Ready(None));
            assert_eq!(core.module.request(core.now(), CAN, &frame).0, Poll::Ready(None));
            core.poll(core.now().0 + 1_000);
            assert_eq!(*core.module.link_settings(), before, "{setting}");
        };
        bystander(&mut core);
        core.store();
        bystander(&mut core);
        for source in [CAN, Source::Rs485, Source::Usb] {
            bystander(&mut core);
            assert_eq!(core.module.next_reply().unwrap().to.source, source, "{setting}");
            // The reply is encoded with the settings of this moment.
            assert_eq!(*core.module.link_settings(), before, "{setting}");
        }
        assert_eq!(core.module.next_reply(), None);
        assert_ne!(*core.module.link_settings(), before, "{setting}");
    }
}

/// A move that begins in the very moment in which a heartbeat is missed is stopped with the next poll. The motion
/// controller has hardly begun with it then, and the motor makes no step.
#[test]
fn a_move_that_begins_as_a_heartbeat_is_missed_makes_no_step() {
    for (parameter, silent, other) in [(68, Source::Usb, CAN), (82, CAN, Source::Usb)] {
        for motion in ["MVP ABS, 0, 100000", "MVP REL, 0, -100000", "SAP 0, 0, 5000", "ROR 0, 100"] {
            for moment in [30_500, 30_900, 30_970] {
                let mut core = Core::new();
                core.ok(&format!("SGP {parameter}, 0, 20"));
                core.poll_in_time(10_000);
                core.board.borrow_mut().advance_to((moment - 20_000) * MICROSECOND);
                assert!(core.execute(silent, "GAP 4, 0").is_ready());
                core.poll_in_time(30_400);
                core.board.borrow_mut().advance_to(moment * MICROSECOND);
                let Poll::Ready(Some(Reply::Plain { status: Status::Ok, .. })) = core.execute(other, motion) else {
                    panic!("{motion} is in time")
                };
                core.poll_in_time(31_000);
                // Mode and speed in a reply over the other link.
                let mut read = |line: &str| match core.execute(other, line) {
                    Poll::Ready(Some(Reply::Plain { status: Status::Ok, value, .. })) => value,
                    reply => panic!("{line}: {reply:?}"),
                };
                assert_eq!((read("GAP 138, 0"), read("GAP 2, 0")), (2, 0), "{motion}, {moment}");
                core.poll_in_time(300_000);
                assert_eq!(core.board.borrow().world().axis(0).motor().rotor(), 0, "{motion}, {moment}");
            }
        }
    }
}

/// Replies that wait to be fetched are nobody's any more when their host is gone; those of the other links stay, in
/// order.
#[test]
fn replies_to_a_host_that_is_gone_are_dropped() {
    for (gone, left) in
        [(Source::Usb, [CAN, Source::Rs485]), (Source::Rs485, [Source::Usb, CAN]), (CAN, [Source::Usb, Source::Rs485])]
    {
        let mut core = Core::new();
        for (source, line) in [(Source::Usb, "SGP 77, 0, 1"), (CAN, "SGP 84, 0, 1"), (Source::Rs485, "SGP 85, 0, 1")] {
            assert_eq!(core.execute(source, line), Poll::Pending);
        }
        core.store();
        core.module.forget(gone);
        let heard: Vec<_> = iter::from_fn(|| core.module.next_reply()).map(|due| due.to.source).collect();
        assert_eq!(heard, left, "{gone:?}");
    }
}

/// With global parameter 255 a link that waits is told that there will be no reply, and in its turn; another one's
/// reply keeps its place.
#[test]
fn a_suppressed_reply_is_due_like_any_other() {
    let mut core = Core::new();
    assert_eq!(core.execute(CAN, "SGP 77, 0, 1"), Poll::Pending);
    assert!(core.execute(Source::Usb, "SGP 255, 0, 1").is_ready());
    assert_eq!(core.execute(Source::Rs485, "SGP 85, 0, 1"), Poll::Pending);
    assert_eq!(core.module.next_reply(), None);
    assert!(core.module.awaits(Source::Rs485));
    core.store();
    let due: Vec<_> = iter::from_fn(|| core.module.next_reply()).collect();
    let value = Reply::Plain { status: Status::Ok, opcode: 9, value: 1 };
    let told = |source: Source, reply| Due { to: source.into(), reply };
    assert_eq!(due, [told(CAN, Some(value)), told(Source::Rs485, None)]);
    assert!(!core.module.awaits(Source::Rs485));
}

/// A link that is busy takes its events later. While none is taken they stay those of the axes that have arrived, and a
/// new request of the same host leaves them. When the host is gone, or another one asks, they are nobody's any more.
#[test]
fn events_wait_for_their_link() {
    let event = |source: Source| {
        let reply = Reply::Plain { status: Status::PositionReached, opcode: 138, value: 1 };
        Some(Due { to: source.into(), reply: Some(reply) })
    };
    for source in [Source::Usb, CAN, Source::Rs485] {
        let arrived = || {
            let mut core = Core::new();
            assert!(core.execute(source, "138, 1, 0, 1").is_ready());
            core.ok("MVP ABS, 0, 0");
            core.poll_in_time(20_000);
            assert_eq!(core.module.next_event(|link| link != source), None, "{source:?}");
            core
        };
        let mut core = arrived();
        core.poll_in_time(100_000);
        assert!(core.execute(source, "138, 0, 0, 1").is_ready());
        assert!(core.module.calm().is_none(), "it still has something to say");
        assert_eq!(core.module.next_event(|link| link == source), event(source));
        assert_eq!(core.module.next_event(|_| true), None, "{source:?}");
        let mut core = arrived();
        core.module.forget(source);
        assert_eq!(core.module.next_event(|_| true), None, "{source:?}");
        let mut core = arrived();
        let other = if source == CAN { Source::Usb } else { CAN };
        assert!(core.execute(other, "138, 1, 0, 1").is_ready());
        assert_eq!(core.module.next_event(|_| true), None, "{source:?}");
    }
}
