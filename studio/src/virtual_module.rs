//! A virtual module whose time goes by the clock of the page, or as the lines of its control port say. What it runs,
//! the firmware's core or a flash image, is the choice of who starts it.

use std::task::Poll;
use std::time::Duration;

use hal_sim::board::BoardKind;
use hal_sim::clock::{MICROSECOND, MILLISECOND};
use hal_sim::world::config::WorldConfig;
use tmcl_tools::desk::{
    ControllerId, Inquiries, Outcome as Carried, Timekeeper, Told, Watch, Watcher, answer, carry_out,
};
use tmcl_tools::product;
use tmcl_tools::request::Typed;
use tmcm_sim::client::Client;
use tmcm_sim::fleet::{Fleet, Member};
use tmcm_sim::protocol::{Request as Protocol, Speed};
use tmcm_sim::{Model, NativeModule, Product, VirtualModule};

use crate::recorder::Recorder;
use crate::running::Running;
use crate::scope::Watched;
use crate::session::{Around, Journal, Player, What};
use crate::types::{
    Contents, Finished, Line, LineTold, Module, Nothing, Outcome, Play, Request, SampleRow, Start, Ticket, Turn,
};
use crate::watching::Page;
use crate::world::{self, WorldSeen};
use crate::writes::Writes;

/// Seed of the module's random numbers.
const SEED: u32 = 1;
/// Longest sleep while the module has nothing to do.
const NAP: Duration = Duration::from_millis(10);

/// How a module is made that stands in a world, with a seed of its random numbers.
pub type Make<M> = Box<dyn Fn(Member<'_>, u32) -> Result<M, String>>;

/// A virtual module, and who asks it.
pub struct Virtual<M> {
    product: Product,
    world: WorldConfig,
    /// How it has begun.
    start: Start,
    make: Make<M>,
    fleet: Fleet<M>,
    kinds: [&'static BoardKind; 1],
    timekeeper: Timekeeper,
    inquiries: Inquiries,
    page: Page,
    /// Requests that wait for their replies, with the number of each.
    asked: Vec<(u32, Client)>,
    last: u32,
    /// How often it has begun anew.
    starts: u32,
    writes: Writes,
}

/// The module, alone among its like.
pub(crate) fn fleet<M: VirtualModule>(
    product: Product,
    world: &WorldConfig,
    eeprom: Option<&[u8]>,
    make: &Make<M>,
) -> Result<Fleet<M>, String> {
    let member = Member { model: Model::Tmcl(product), world, eeprom };
    let mut fleet = Fleet::start(&[member], SEED, make)?;
    fleet.await_silences();
    Ok(fleet)
}

/// How a module is made that runs the firmware's core.
pub(crate) fn of_the_core() -> Make<NativeModule> {
    Box::new(|Member { model, world, eeprom }, seed| Ok(NativeModule::of(model, world, eeprom, seed)))
}

impl Virtual<NativeModule> {
    /// A fresh module that runs the firmware's core, at the moment `at`.
    ///
    /// # Errors
    /// There is no such product, or its world or its EEPROM cannot be so.
    pub fn start(start: &Start, at: Duration) -> Result<Self, String> {
        Self::of(start, at, of_the_core())
    }

    /// A fresh module to which is done what was done to another one. Its time stands still until it is let go, and at
    /// the end of that.
    ///
    /// # Errors
    /// Those of [`start`](Self::start), or something of it cannot be done.
    pub fn play(play: &Play, at: Duration) -> Result<Self, String> {
        let player = Player::of(play)?;
        let mut module = Self::start(&play.start, at)?;
        module.timekeeper.pause(0, &module.fleet)?;
        module.timekeeper.pause_at(Some(player.until()));
        module.page.player = Some(player);
        // What is done at once is done before any time passes.
        module.page.tell(&mut module.fleet);
        Ok(module)
    }
}

impl<M: VirtualModule> Virtual<M> {
    /// A fresh module, at the moment `at`, as `make` makes it.
    ///
    /// # Errors
    /// There is no such product, its world cannot be so, or the module cannot be made.
    pub fn of(start: &Start, at: Duration, make: Make<M>) -> Result<Self, String> {
        let product = product::named(&start.product)?;
        let (world, eeprom) = (world::config(start)?, world::eeprom(start, product)?);
        let fleet = fleet(product, &world, eeprom.as_deref(), &make)?;
        let timekeeper = Timekeeper::new(Speed::Factor(1.0), None, at, fleet.now());
        let mut module = Virtual {
            product,
            world,
            start: start.clone(),
            make,
            fleet,
            kinds: [product.kind()],
            timekeeper,
            inquiries: Inquiries::default(),
            page: Page::default(),
            asked: Vec::new(),
            last: 0,
            starts: 0,
            writes: Writes::default(),
        };
        module.count_writes();
        Ok(module)
    }

    fn count_writes(&mut self) {
        let writes = Box::new(self.writes.clone());
        if let Some(module) = self.fleet.modules_mut().first_mut() {
            module.board_mut().at25_mut().keep_in(writes);
        }
    }

    fn contents(&mut self) -> Option<Vec<u8>> {
        self.fleet.modules_mut().first_mut().map(|module| module.board_mut().at25().contents().to_vec())
    }

    /// Somebody does something to the module at the next whole microsecond: what is done to it by itself ends.
    fn take_over(&mut self, what: What) {
        self.page.player = None;
        self.timekeeper.pause_at(None);
        self.page.journal.note(self.fleet.now(), what);
    }

    /// Notes a line of the control port that was carried out, if it has changed something.
    fn note_line(&mut self, line: &str) {
        let what = match Protocol::parse(line, &self.kinds) {
            // It has gone to the module as any other command.
            Ok(Protocol::Send { command, .. }) => {
                let request = Typed::parse(&command).and_then(|typed| typed.request(Some(self.product)));
                request.ok().map(|request| What::Command(request.command))
            }
            Ok(request) => Around::of(&request).map(|around| What::Around(line.into(), around)),
            Err(_) => None,
        };
        if let Some(what) = what {
            self.take_over(what);
        }
    }

    /// Lets time pass to the next whole microsecond, in which sessions have their times.
    fn settle(&mut self) {
        let whole = self.fleet.now().next_multiple_of(MICROSECOND);
        if whole > self.fleet.now() {
            self.fleet.run_until(whole);
            self.page.tell(&mut self.fleet);
        }
    }

    fn answer(&mut self, ControllerId(asker): ControllerId, result: Result<Option<Told>, String>) {
        let ticket = u32::try_from(asker).ok();
        self.page.lines.push(LineTold { ticket, line: answer(result) });
    }

    /// The module begins anew, with what its EEPROM has.
    fn restart(&mut self, asker: ControllerId, at: Duration) {
        let eeprom = self.contents();
        match fleet(self.product, &self.world, eeprom.as_deref(), &self.make) {
            Ok(fleet) => self.fleet = fleet,
            Err(error) => return self.answer(asker, Err(error)),
        }
        self.start.eeprom = eeprom.as_deref().map(world::contents);
        self.count_writes();
        (self.page.journal, self.page.player) = (Journal::default(), None);
        self.starts = self.starts.wrapping_add(1);
        self.timekeeper = self.timekeeper.anew(at, self.fleet.now());
        // Its time begins anew, and with it the milliseconds.
        if let Some(recorder) = &mut self.page.recorder {
            recorder.begin_anew(self.fleet.now());
        }
        let told = Told::time(self.fleet.now());
        if self.page.watch.take().is_some() {
            self.page.lines.push(LineTold { ticket: None, line: Watch::ended("restart") });
        }
        self.inquiries.end().into_iter().for_each(|(asker, result)| self.answer(asker, result));
        self.answer(asker, Ok(Some(told)));
    }
}

impl<M: VirtualModule> Running for Virtual<M> {
    fn module(&self) -> Module {
        Module { name: self.product.name().into(), product: Some(product::short(self.product).into()) }
    }

    fn ask(&mut self, asked: Request) -> Ticket {
        self.settle();
        self.take_over(What::Command(asked.command()));
        self.last = self.last.wrapping_add(1);
        self.asked.push((self.last, self.fleet.ask(0, asked.command())));
        Ticket { ticket: self.last }
    }

    fn done(&mut self) -> Result<Play, String> {
        let until = self.fleet.now().div_ceil(MICROSECOND);
        Ok(Play { start: self.start.clone(), done: self.page.journal.texts()?, until })
    }

    fn eeprom(&mut self) -> Contents {
        Contents { eeprom: self.contents().as_deref().map(world::contents).unwrap_or_default() }
    }

    fn look(&mut self, watched: &Watched) -> SampleRow {
        Recorder::new(watched, self.product, self.fleet.now()).look(&mut self.fleet)
    }

    fn see(&mut self, watched: &Watched, at: Duration) -> WorldSeen {
        let row = self.look(watched);
        let (paused, busy) = (self.timekeeper.is_paused(), self.timekeeper.is_stepping());
        let factor = self.timekeeper.pace(at, self.fleet.now());
        let behind = self.timekeeper.behind() as f64 / MILLISECOND as f64;
        WorldSeen { row, paused, busy, factor, wanted: self.timekeeper.wanted(), behind }
    }

    fn watch(&mut self, watched: &Watched) -> Nothing {
        let recorder = Recorder::new(watched, self.product, self.fleet.now());
        self.page.recorder = Some(recorder).filter(|_| !watched.texts.is_empty());
        Nothing {}
    }

    fn control(&mut self, Line { line }: &Line, at: Duration) -> Ticket {
        self.last = self.last.wrapping_add(1);
        let ticket = self.last;
        self.settle();
        // Each line is that of somebody else, as if it came over a connection of its own.
        let asker = ControllerId(ticket.into());
        let Virtual { fleet, timekeeper, inquiries, kinds, .. } = self;
        match carry_out(asker, line, kinds, fleet, timekeeper, inquiries, at) {
            Ok(Carried::Later) => self.note_line(line),
            Ok(Carried::Done(told)) => {
                self.note_line(line);
                self.answer(asker, Ok(told));
            }
            Ok(Carried::Watch(watch)) => {
                self.answer(asker, Ok(Some(Told::time(watch.begun()))));
                self.page.watch = Some(watch);
            }
            Ok(Carried::Unwatch) => {
                self.page.watch = None;
                self.answer(asker, Ok(None));
            }
            Err(error) => self.answer(asker, Err(error)),
        }
        Ticket { ticket }
    }

    fn turn(&mut self, clock: &dyn Fn() -> Duration) -> Turn {
        let watchers = std::slice::from_mut(&mut self.page);
        self.timekeeper.run(&mut self.fleet, watchers, clock);
        if let Some(asker) = self.timekeeper.take_restart() {
            self.restart(asker, clock());
        }
        let finished = self.timekeeper.serve(&mut self.fleet, std::slice::from_mut(&mut self.page), clock);
        let mut replies = Vec::new();
        if !self.timekeeper.holds_replies() {
            let finished = self.inquiries.finished(&mut self.fleet);
            finished.into_iter().for_each(|(asker, result)| self.answer(asker, result));
            let fleet = &mut self.fleet;
            self.asked.retain(|(ticket, client)| match fleet.reply_to(*client) {
                Poll::Ready(reply) => {
                    let outcome = reply.map_or(Outcome::NoReply(0), |reply| Outcome::Reply(reply.into()));
                    replies.push(Finished { ticket: *ticket, outcome });
                    false
                }
                Poll::Pending => true,
            });
        }
        finished.into_iter().for_each(|(asker, result)| self.answer(asker, result));
        for asker in self.timekeeper.take_interrupters() {
            let told = Told::time(self.fleet.now());
            self.answer(asker, Ok(Some(told)));
        }
        let stopped = self.fleet.modules().first().and_then(M::stopped);
        let left = self.page.player.as_ref().map(|player| player.until().saturating_sub(self.fleet.now()));
        let left = left.map(|left| left as f64 / MILLISECOND as f64);
        let messages = self.fleet.modules_mut().iter_mut().flat_map(VirtualModule::take_log).collect();
        let now = clock();
        let wake = self.timekeeper.wake(now, &self.fleet, NAP);
        let nap = wake.saturating_sub(now).as_secs_f64() * 1000.0;
        let rows = self.page.recorder.as_mut().map(Recorder::rows).unwrap_or_default();
        Turn {
            replies,
            lines: std::mem::take(&mut self.page.lines),
            messages,
            rows,
            paused: self.timekeeper.is_paused(),
            powered: self.fleet.modules_mut().first_mut().is_some_and(|module| module.board_mut().is_powered()),
            starts: self.starts,
            stored: self.writes.count(),
            left,
            stopped,
            nap,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use tmcm::tmcl::Command;

    use super::*;

    fn watched(texts: &[&str]) -> Watched {
        Watched { texts: texts.iter().map(ToString::to_string).collect() }
    }

    /// A page whose clock goes on by a millisecond with each look.
    struct Desk {
        module: Virtual<NativeModule>,
        clock: Cell<u64>,
    }

    impl Desk {
        fn of(product: &str) -> Self {
            Desk {
                module: Virtual::start(&Start { product: product.into(), world: None, eeprom: None }, Duration::ZERO)
                    .unwrap(),
                clock: Cell::new(0),
            }
        }

        fn turn(&mut self) -> Turn {
            let clock = &self.clock;
            self.module.turn(&|| {
                clock.set(clock.get() + 1);
                Duration::from_millis(clock.get())
            })
        }

        fn ask(&mut self, command: Command) -> Outcome {
            let Ticket { ticket } = self.module.ask(Request::new(1, command));
            for _ in 0..10_000 {
                if let Some(finished) = self.turn().replies.pop() {
                    assert_eq!(finished.ticket, ticket);
                    return finished.outcome;
                }
            }
            panic!("no end of {command}");
        }

        fn control(&mut self, line: &str) -> serde_json::Value {
            self.module.control(&Line { line: line.into() }, Duration::from_millis(self.clock.get()));
            for _ in 0..10_000 {
                if let Some(told) = self.turn().lines.pop() {
                    return serde_json::from_str(&told.line).unwrap();
                }
            }
            panic!("no answer to {line}");
        }
    }

    #[test]
    fn a_motor_turns_by_the_clock_and_stands_while_time_is_paused() {
        let mut desk = Desk::of("1140");
        assert!(matches!(desk.ask(Command::new(1, 0, 0, 500)), Outcome::Reply(bytes) if bytes[2] == 100));
        assert_eq!(desk.control("pause")["ok"], true);
        let before = desk.control("state")["rotor"].as_i64().unwrap();
        (0..100).for_each(|_| drop(desk.turn()));
        assert_eq!(desk.control("state")["rotor"], before);
        let watched = watched(&["GAP 3, 0", "GAP 1, 9", "GAP 2, 0"]);
        let time = desk.control("state")["time_us"].clone();
        assert_eq!(desk.module.look(&watched).values[1..], [None, None]);
        assert_eq!(desk.control("state")["time_us"], time);
        assert_eq!(desk.control("state")["rotor"], before);
        desk.control("step 1 s");
        assert!(desk.control("state")["rotor"].as_i64().unwrap() > before + 1000);
        assert_eq!(desk.module.look(&watched).values, [Some(500.0), None, None]);
    }

    /// Sessions have their times in microseconds, whatever the clock of the page has.
    #[test]
    fn what_is_done_is_done_at_whole_microseconds() {
        let mut desk = Desk::of("1140");
        let nanos = Cell::new(0);
        desk.module.turn(&|| {
            nanos.set(nanos.get() + 1_000_333);
            Duration::from_nanos(nanos.get())
        });
        assert_ne!(desk.module.fleet.now() % MICROSECOND, 0, "the clock stands between two of them");
        desk.module.ask(Request::new(1, Command::new(6, 1, 0, 0)));
        assert_eq!(desk.module.fleet.now() % MICROSECOND, 0);
    }

    /// 51 200 pps of a TMC5160 at 16 MHz are 51 200 * 2^24 / 16e6 = 53 687 of its units, and 51 200 again to the pps.
    #[test]
    fn speeds_are_in_the_unit_of_the_product() {
        let mut desk = Desk::of("3212");
        desk.ask(Command::new(1, 0, 2, 51_200));
        desk.control("pause");
        desk.control("step 2 s");
        assert_eq!(desk.module.look(&watched(&["GAP 3, 2"])).values, [Some(51_200.0)]);
    }

    /// Each millisecond has a row, however the time passes, and none is there twice.
    #[test]
    fn each_millisecond_has_a_row() {
        let mut desk = Desk::of("6110");
        desk.ask(Command::new(1, 0, 5, 500));
        desk.control("pause");
        let begun = desk.control("state")["time_us"].as_i64().unwrap() / 1000;
        desk.module.watch(&watched(&["GAP 1, 5", "rotor 5", "GAP 4, 5"]));
        assert!(desk.turn().rows.is_empty(), "time is paused");
        desk.module.control(&Line { line: "step 2500 ms".into() }, Duration::ZERO);
        let mut rows = Vec::new();
        while rows.len() < 2500 {
            rows.extend(desk.turn().rows);
        }
        let at: Vec<i64> = rows.iter().map(|row| row.at as i64).collect();
        assert_eq!(at, (begun + 1..=begun + 2500).collect::<Vec<_>>());
        let (first, last) = (&rows[0].values, &rows[2499].values);
        assert!(last[0] > first[0] && last[1] > first[1] && last[2].is_some());
        assert!(desk.module.look(&watched(&["GAP 1, 5"])).values[0] >= last[0]);
        assert_eq!(desk.control("restart")["ok"], true);
        desk.control("step 3 ms");
        let rows = desk.turn().rows;
        assert!(rows.iter().all(|row| row.at < begun as f64), "time has begun anew: {rows:?}");
        desk.module.watch(&watched(&[]));
        desk.control("step 3 ms");
        assert!(desk.turn().rows.is_empty());
    }

    #[test]
    fn a_restart_keeps_what_is_stored() {
        let mut desk = Desk::of("6110");
        desk.ask(Command::new(5, 4, 5, 777));
        desk.ask(Command::new(7, 4, 5, 0));
        assert_eq!(desk.control("restart")["ok"], true);
        assert!(
            matches!(desk.ask(Command::new(6, 4, 5, 0)), Outcome::Reply(bytes) if bytes[6..8] == [3, 9]),
            "777 is 3 * 256 + 9"
        );
    }

    #[test]
    fn without_power_there_is_no_reply() {
        let mut desk = Desk::of("1140");
        desk.control("power off");
        assert_eq!(desk.ask(Command::new(6, 1, 0, 0)), Outcome::NoReply(0));
        assert!(desk.control("fault fire on")["error"].as_str().unwrap().contains("unknown fault 'fire'"));
        let start = |product: &str, world: &str| {
            let start = Start { product: product.into(), world: Some(world.into()), eeprom: None };
            Virtual::start(&start, Duration::ZERO).map(|_| ()).unwrap_err()
        };
        assert!(start("9999", "").contains("9999"));
        assert!(start("1140", "[motor]\nfrictoin = 1").contains("frictoin"));
    }

    /// The stage of the world is there again after a restart: the motor does not get past its end.
    #[test]
    fn a_world_is_kept() {
        let world = Some("[stage]\nhard_left = -512".into());
        let module = Virtual::start(&Start { product: "1140".into(), world, eeprom: None }, Duration::ZERO).unwrap();
        let mut desk = Desk { module, clock: Cell::new(0) };
        assert_eq!(desk.control("restart")["ok"], true);
        desk.ask(Command::new(2, 0, 0, 500));
        desk.control("pause");
        desk.control("step 2 s");
        let rotor = desk.control("state")["rotor"].as_i64().unwrap();
        assert!((-1100..=-500).contains(&rotor), "{rotor}");
    }
}
