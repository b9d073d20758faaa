//! The timekeeper of virtual time: by the clock; or paused, where it passes by steps and for what hosts are waiting
//! for.
//!
//! Nothing here holds the simulator up. What takes long is done in turns, and between them links and connections are
//! served.

use std::time::Duration;

use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::control::State;
use tmcm_sim::VirtualModule;
use tmcm_sim::fleet::Fleet;
use tmcm_sim::protocol::{Seen, Speed};
use tmcm_sim::scenario::condition::Condition;

use super::answer::{Going, Report, Told};
use super::controller::{ControllerId, Watcher};
use super::pacing::Pacer;

/// Longest real time spent on virtual time before links and connections are served again.
const LONGEST_TURN: Duration = Duration::from_millis(2);
/// Span of virtual time that is simulated between two looks at the clock while something happens, in nanoseconds;
/// conditions are looked at as often.
const PORTION: Nanos = MILLISECOND;

/// Longest sleep while time is paused and nobody waits for anything.
const REST: Duration = Duration::from_millis(50);

/// How virtual time passes, and on whose behalf.
#[derive(Debug)]
pub struct Timekeeper {
    pacer: Pacer,
    /// While time is paused: how much of it passes after each reply.
    paused: Option<Nanos>,
    /// When time that goes by the clock is paused by itself.
    end: Option<Nanos>,
    /// Virtual time that is still to pass after replies.
    debt: Nanos,
    /// Replies that have been counted for that.
    counted: u64,
    /// The task that a connection waits for. There is one at a time.
    errand: Option<Errand>,
    /// The connection that waits for a restart.
    restart: Option<ControllerId>,
    /// The connections that have asked for the end of what is under way, and wait for it.
    interrupters: Vec<ControllerId>,
    /// True if the last turn has ended before all was done that there was to do.
    is_working: bool,
}

/// Something that takes virtual time, and that a connection to the control port waits for.
#[derive(Debug)]
struct Errand {
    asker: ControllerId,
    task: Task,
    /// Until when time passes at most; `None` until it begins, which is when no request waits for its reply.
    goal: Option<Nanos>,
}

/// A task that is to be done.
#[derive(Debug)]
pub enum Task {
    /// Time passes.
    Step(Nanos),
    /// Time passes until something holds, but not longer.
    RunUntil {
        /// Index of the module for which it is to hold.
        module: usize,
        /// The condition that is to hold.
        condition: Condition,
        /// How much time passes at most.
        longest: Nanos,
    },
}

impl Task {
    /// The name of its command.
    fn name(&self) -> &'static str {
        match self {
            Task::Step(_) => "step",
            Task::RunUntil { .. } => "run-until",
        }
    }

    /// How much time passes at most.
    fn longest(&self) -> Nanos {
        match self {
            Task::Step(span) | Task::RunUntil { longest: span, .. } => *span,
        }
    }

    /// The answer, if the task is done at this moment, because the time for it `is_over` or because what was waited for
    /// is so.
    fn outcome(&self, fleet: &mut Fleet<impl VirtualModule>, is_over: bool) -> Option<Result<Option<Told>, String>> {
        let now = fleet.now();
        match self {
            Task::Step(_) => is_over.then(|| Ok(Some(Told::time(now)))),
            Task::RunUntil { module, condition, .. } => {
                let module = fleet.modules_mut().get_mut(*module)?;
                match condition.violated(&mut Seen(module)) {
                    Ok(violated) if violated.is_none() || is_over => Some(Ok(Some(Told::met(violated.is_none(), now)))),
                    Ok(_) => None,
                    Err(error) => Some(Err(error)),
                }
            }
        }
    }
}

/// A task that is done: the connection that waited for it, and its answer.
pub type Finished = (ControllerId, Result<Option<Told>, String>);

impl Timekeeper {
    /// The timekeeper from virtual time `now` on, at the moment `at`: by the clock at this speed; or paused, and
    /// `paused` is how much time passes after each reply.
    pub fn new(speed: Speed, paused: Option<Nanos>, at: Duration, now: Nanos) -> Self {
        let pacer = Pacer::new(speed, at, now);
        Timekeeper {
            pacer,
            paused,
            end: None,
            debt: 0,
            counted: 0,
            errand: None,
            restart: None,
            interrupters: Vec::new(),
            is_working: false,
        }
    }

    /// The timekeeper of new modules from virtual time `now` on, at the moment `at`, paused and as fast as this one.
    pub fn anew(&mut self, at: Duration, now: Nanos) -> Self {
        let interrupters = std::mem::take(&mut self.interrupters);
        Timekeeper { interrupters, ..Self::new(self.pacer.wanted(), self.paused, at, now) }
    }

    /// True while time passes by steps and for requests alone.
    pub fn is_paused(&self) -> bool {
        self.paused.is_some()
    }

    /// True while a step is wanted or under way: what hosts send meanwhile is taken when it has ended.
    pub fn is_stepping(&self) -> bool {
        self.errand.is_some()
    }

    /// True while replies are kept back, because time is to pass after one of them before its host can go on.
    pub fn holds_replies(&self) -> bool {
        self.debt > 0
    }

    /// True while time is paused and nobody waits for some of it to pass.
    pub fn is_at_rest(&self) -> bool {
        self.is_paused() && !self.is_working
    }

    /// Takes the connection that has asked for a restart, which is for the owner of the modules to do.
    pub fn take_restart(&mut self) -> Option<ControllerId> {
        self.restart.take()
    }

    /// Takes the connections that have waited for the end of what was under way, once it has come.
    pub fn take_interrupters(&mut self) -> Vec<ControllerId> {
        if self.is_busy() { Vec::new() } else { std::mem::take(&mut self.interrupters) }
    }

    /// How time goes, for the answer to `state`.
    pub fn report(&mut self, state: State, at: Duration, now: Nanos) -> Report {
        Report { state, time: self.going(), speed_factor: self.pace(at, now), speed_wanted: self.wanted() }
    }

    /// How fast time has been going lately, as a factor of the clock, in thousandths.
    pub fn pace(&mut self, at: Duration, now: Nanos) -> f64 {
        if self.is_paused() {
            self.pacer.rest(at, now);
        }
        (self.pacer.achieved() * 1000.0).round() / 1000.0
    }

    /// How fast time is wanted to go, as a factor of the clock; `None` if as fast as it can.
    pub fn wanted(&self) -> Option<f64> {
        self.pacer.wanted().factor()
    }

    /// How far time that goes by the clock has fallen behind, since it last was paused.
    pub fn behind(&self) -> Nanos {
        self.pacer.behind()
    }

    /// Whether time goes by the clock.
    pub fn going(&self) -> Going {
        if self.is_paused() { Going::Paused } else { Going::Running }
    }

    /// How far behind time is, if a person should be told, and how fast it has been going.
    pub fn lag(&mut self) -> Option<(Nanos, f64)> {
        let achieved = self.pacer.achieved();
        self.pacer.lag().map(|lag| (lag, achieved))
    }

    /// Time that goes by the clock is paused when it has come to `end`.
    pub fn pause_at(&mut self, end: Option<Nanos>) {
        self.end = end;
    }

    /// Time stands still from now on, and `after_reply` of it passes after each reply.
    pub fn pause(&mut self, after_reply: Nanos, fleet: &Fleet<impl VirtualModule>) -> Result<(), String> {
        self.refuse_if_busy()?;
        self.hold(after_reply, fleet);
        Ok(())
    }

    fn hold(&mut self, after_reply: Nanos, fleet: &Fleet<impl VirtualModule>) {
        if !self.is_paused() {
            self.counted = fleet.answered();
        }
        self.paused = Some(after_reply);
    }

    /// Time goes by the clock from now on. What the clock has gone meanwhile is not made up for.
    pub fn resume(&mut self, at: Duration, fleet: &Fleet<impl VirtualModule>) -> Result<(), String> {
        self.refuse_if_busy()?;
        self.paused = None;
        self.debt = 0;
        self.pacer.rest(at, fleet.now());
        Ok(())
    }

    /// Changes how fast time goes by the clock.
    pub fn set_speed(&mut self, speed: Speed, at: Duration) {
        self.pacer.set_speed(speed, at);
    }

    /// Begins with what takes virtual time, as soon as no request waits for its reply. The answer is for `asker`.
    pub fn begin(&mut self, asker: ControllerId, task: Task) -> Result<(), String> {
        self.refuse_if_busy()?;
        if !self.is_paused() {
            return Err(format!("time goes by the clock, so there is no '{}': write 'pause' before it", task.name()));
        }
        self.errand = Some(Errand { asker, task, goal: None });
        Ok(())
    }

    /// All is to begin anew. The answer is for `asker`.
    pub fn ask_restart(&mut self, asker: ControllerId) -> Result<(), String> {
        self.refuse_if_busy()?;
        self.restart = Some(asker);
        Ok(())
    }

    /// Ends what is under way for a connection, as if its time were over, and `from` waits until it has ended: the next
    /// line of `from` comes after that. False if nothing is under way.
    pub fn interrupt(&mut self, from: ControllerId, now: Nanos) -> bool {
        if let Some(errand) = &mut self.errand {
            errand.goal = Some(now);
        }
        let is_busy = self.is_busy();
        if is_busy {
            self.interrupters.push(from);
        }
        is_busy
    }

    /// True while something is under way that takes virtual time, or a restart is to come.
    fn is_busy(&self) -> bool {
        self.errand.is_some() || self.restart.is_some()
    }

    /// # Errors
    /// Something is under way that takes virtual time, or a restart is to come.
    pub fn refuse_if_busy(&self) -> Result<(), String> {
        let name = match (&self.errand, self.restart) {
            (Some(errand), _) => errand.task.name(),
            (None, Some(_)) => "restart",
            (None, None) => return Ok(()),
        };
        Err(format!("busy: a '{name}' is under way; write this again when that is answered"))
    }

    /// When, after the moment `at`, the simulator has something to do again although nothing arrives. `nap` is its
    /// longest sleep while the modules have nothing to do for a host.
    pub fn wake(&self, at: Duration, fleet: &Fleet<impl VirtualModule>, nap: Duration) -> Duration {
        if self.is_paused() {
            return at + if self.is_at_rest() { REST } else { Duration::ZERO };
        }
        let nap = if self.pacer.is_behind() { Duration::ZERO } else { nap };
        let wake = self.pacer.when(self.pacer.reached()) + nap;
        let due = fleet.next_event().filter(|_| fleet.is_busy());
        due.map_or(wake, |due| wake.min(self.pacer.when(due)))
    }

    /// Lets time pass by the clock, up to the present or as far as a turn suffices.
    pub fn run(
        &mut self,
        fleet: &mut Fleet<impl VirtualModule>,
        watchers: &mut [impl Watcher],
        clock: &dyn Fn() -> Duration,
    ) {
        if self.is_paused() {
            return;
        }
        let begun = clock();
        let goal = self.pacer.advance(begun).min(self.end.unwrap_or(Nanos::MAX));
        while self.pacer.reached() < goal && clock().saturating_sub(begun) < LONGEST_TURN {
            let to = goal.min(self.pacer.reached() + stretch(fleet));
            pass(to, fleet, watchers);
            self.pacer.reach(to);
        }
        if self.end.is_some_and(|end| end <= fleet.now()) {
            self.end = None;
            self.hold(0, fleet);
        }
    }

    /// Lets paused time pass for those who wait for it, as far as is needed or as a turn suffices. Gives what has been
    /// done for a connection.
    pub fn serve(
        &mut self,
        fleet: &mut Fleet<impl VirtualModule>,
        watchers: &mut [impl Watcher],
        clock: &dyn Fn() -> Duration,
    ) -> Option<Finished> {
        let after_reply = self.paused?;
        let begun = clock();
        let finished = loop {
            match self.portion(after_reply, fleet, watchers) {
                Portion::Idle => {
                    self.is_working = false;
                    break None;
                }
                Portion::Finished(finished) => {
                    self.is_working = true;
                    break Some(finished);
                }
                Portion::Passed if clock().saturating_sub(begun) < LONGEST_TURN => {}
                Portion::Passed => {
                    self.is_working = true;
                    break None;
                }
            }
        };
        self.pacer.rest(clock(), fleet.now());
        finished
    }

    /// Lets a portion of paused time pass for whose turn it is: a step; the time after replies; requests. Once nobody
    /// waits for a reply any more, a step begins.
    fn portion(
        &mut self,
        after_reply: Nanos,
        fleet: &mut Fleet<impl VirtualModule>,
        watchers: &mut [impl Watcher],
    ) -> Portion {
        let now = fleet.now();
        if let Some(Errand { asker, task, goal: Some(goal) }) = &mut self.errand {
            let (asker, goal) = (*asker, *goal);
            // No watch loses a line: time waits until its client has read.
            if now < goal && watchers.iter_mut().any(Watcher::is_behind) {
                return Portion::Idle;
            }
            let Some(result) = task.outcome(fleet, now >= goal) else {
                let span = if matches!(task, Task::Step(_)) { stretch(fleet) } else { PORTION };
                let to = goal.min(now.saturating_add(span));
                while fleet.now() < to && !watchers.iter_mut().any(Watcher::is_behind) {
                    pass(next_line(watchers).map_or(to, |due| due.min(to)), fleet, watchers);
                }
                return Portion::Passed;
            };
            self.errand = None;
            self.counted = fleet.answered();
            return Portion::Finished((asker, result));
        }
        if self.debt > 0 {
            let span = self.debt.min(PORTION);
            pass(now + span, fleet, watchers);
            self.debt -= span;
        } else if fleet.serve(next_line(watchers).map_or(now + PORTION, |due| due.min(now + PORTION))) {
            watchers.iter_mut().for_each(|watcher| watcher.tell(fleet));
        } else if let Some(errand) = &mut self.errand {
            errand.goal = Some(now + errand.task.longest());
        } else {
            return Portion::Idle;
        }
        let replies = fleet.answered() - self.counted;
        self.counted += replies;
        self.debt += replies * after_reply;
        Portion::Passed
    }
}

/// The outcome of a portion of paused time.
enum Portion {
    /// Nothing: there was nothing to do, or a client has to read first.
    Idle,
    /// Time has passed, or a step has begun.
    Passed,
    /// A task that a connection waited for has been done.
    Finished(Finished),
}

/// The time that may pass between two looks at the clock: [`PORTION`], or more where nothing happens for longer, which
/// is soon simulated.
fn stretch(fleet: &Fleet<impl VirtualModule>) -> Nanos {
    fleet.next_event().map_or(PORTION, |due| due.saturating_sub(fleet.now()).max(PORTION))
}

/// When the first line of a watch is due.
fn next_line(watchers: &[impl Watcher]) -> Option<Nanos> {
    watchers.iter().filter_map(Watcher::watch_due).min()
}

/// Lets time pass until `to`, and tells those who watch at their times.
fn pass(to: Nanos, fleet: &mut Fleet<impl VirtualModule>, watchers: &mut [impl Watcher]) {
    while fleet.now() < to {
        fleet.run_until(next_line(watchers).map_or(to, |due| due.min(to)));
        watchers.iter_mut().for_each(|watcher| watcher.tell(fleet));
    }
}
