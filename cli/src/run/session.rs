//! The run itself: virtual time passes, and what happens is passed on to those who want to know.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::control::Control;
use tmcm::module::Source;
use tmcm::tmcl::binary;
use tmcm::tmcl::{Command, Opcode};

use super::host;
use super::recording::{Mark, Recording};
use super::script::{Action, Event};
use super::trace::Trace;
use crate::failure::Failure;
use crate::product::PRODUCT;
use crate::program::Program;
use crate::progress::Progress;
use crate::send::words::{self, Meaning};
use crate::signal::EndSignal;
use crate::tracer::Step;
use crate::virtual_module::VirtualModule;

/// How often the values are taken down.
const TICK: Nanos = MILLISECOND;
/// So many ticks pass between two looks at the real world.
const LOOK: u64 = 64;
/// Who waits longer wants to see how far it is.
const PATIENCE: Duration = Duration::from_secs(1);

/// Why a run is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// The program has ended, and no event is left.
    Program,
    /// The time is up.
    Time,
    /// Ctrl-C.
    Signal,
}

/// What was counted.
#[derive(Clone, Debug, Default)]
pub(super) struct Counts {
    /// Commands executed.
    pub(super) executed: u64,
    /// Those of them that had no effect.
    pub(super) refused: u64,
    /// The first of those.
    pub(super) first_refused: Option<Step>,
    /// The last command of all.
    pub(super) last: Option<Step>,
}

/// A program that runs in a virtual module.
pub(super) struct Session<'a> {
    /// The module.
    pub(super) module: VirtualModule,
    program: &'a Program,
    events: VecDeque<Event>,
    trace: Option<Trace>,
    /// For the plot.
    pub(super) recording: Option<Recording>,
    /// When the program was started.
    pub(super) start: Nanos,
    /// How far time has been let go since.
    reached: Nanos,
    /// The last command executed was one of a handler.
    handler: bool,
    pub(super) counts: Counts,
    /// What has happened around the module, and when.
    pub(super) notes: Vec<(Nanos, String)>,
    /// Commands of the host that have not been answered, and when they were sent.
    asked: VecDeque<(Nanos, Command)>,
    /// The module has answered the command that starts the program.
    started: bool,
}

impl<'a> Session<'a> {
    /// Loads the program and gets ready to start it.
    pub(super) fn new(
        mut module: VirtualModule,
        program: &'a Program,
        events: Vec<Event>,
        trace: Option<Trace>,
        recording: Option<Recording>,
    ) -> Result<Self, Failure> {
        host::download(&mut module, program)?;
        module.trace(true);
        // At a whole millisecond of the firmware, so that times are round numbers where it is on time.
        let start = module.next_event().unwrap_or(module.now());
        module.run_until(start);
        Ok(Session {
            start,
            reached: 0,
            module,
            program,
            events: events.into(),
            trace,
            recording,
            handler: false,
            counts: Counts::default(),
            notes: Vec::new(),
            asked: VecDeque::new(),
            started: false,
        })
    }

    /// Time since the program was started. What the module has still been doing when it was looked at does not count.
    pub(super) fn time(&self) -> Nanos {
        self.reached
    }

    /// Runs the program from address 0 on until it has ended and nothing more is to happen, or until `end`.
    pub(super) fn run(&mut self, end: Nanos, signal: &EndSignal) -> Result<End, Failure> {
        let began = Instant::now();
        let mut progress: Option<Progress> = None;
        self.send(Command::new(Opcode::RunApplication as u8, 0, 0, 0));
        self.sample();
        for tick in 1.. {
            let to = end.min(tick * TICK);
            self.advance(to)?;
            self.sample();
            if self.is_over() {
                return self.finish(End::Program);
            }
            if to == end {
                return self.finish(End::Time);
            }
            if tick.is_multiple_of(LOOK) {
                if signal.happened() {
                    return self.finish(End::Signal);
                }
                if began.elapsed() > PATIENCE {
                    let total = (end / TICK) as usize;
                    progress.get_or_insert_with(|| Progress::new("running the program", total)).reach(tick as usize);
                }
            }
        }
        self.finish(End::Time)
    }

    fn finish(&mut self, end: End) -> Result<End, Failure> {
        if let Some(trace) = &mut self.trace {
            trace.finish()?;
        }
        Ok(end)
    }

    /// The program has ended, all events have happened, and the host has its answers.
    fn is_over(&self) -> bool {
        let runs = self.module.machine().is_some_and(|machine| machine.runs());
        !runs && self.events.is_empty() && self.asked.is_empty()
    }

    /// Lets time pass, and the events happen that are due in it.
    fn advance(&mut self, to: Nanos) -> Result<(), Failure> {
        while let Some(event) = self.events.pop_front_if(|event| event.at < to) {
            self.pass(event.at)?;
            self.happen(&event)?;
        }
        self.pass(to)
    }

    fn pass(&mut self, to: Nanos) -> Result<(), Failure> {
        self.module.run_until(self.start + to);
        self.reached = to;
        self.look()
    }

    fn happen(&mut self, event: &Event) -> Result<(), Failure> {
        match event.action {
            Action::World(Control::Power { on }) => self.module.set_power(on),
            Action::World(control) => {
                control.apply(&mut self.module.board().borrow_mut());
            }
            Action::Host(command) => self.send(command),
        }
        if let Some(recording) = &mut self.recording {
            recording.notes.push((event.at, event.text.clone()));
        }
        match event.action {
            // It is told with its answer, where there is one.
            Action::Host(command) if !words::stays_unanswered(command) => {}
            _ => self.notes.push((event.at, event.text.clone())),
        }
        match &mut self.trace {
            Some(trace) => trace.note(event.at, &event.text),
            None => Ok(()),
        }
    }

    fn send(&mut self, command: Command) {
        if !words::stays_unanswered(command) && self.module.machine().is_some() {
            self.asked.push_back((self.time(), command));
        }
        self.module.receive(Source::Usb, binary::encode_command(host::ADDRESS, command));
    }

    /// Takes what has happened since the last look: commands of the program, and answers for the host.
    fn look(&mut self) -> Result<(), Failure> {
        for step in self.module.take_steps() {
            self.take(&step)?;
        }
        while let Some(sent) = self.module.sent() {
            let Some(((at, command), reply)) = self.asked.pop_front().zip(sent.telegram()) else { continue };
            let Meaning { text, done } = words::meaning(PRODUCT, command, &reply);
            if self.started {
                self.notes.push((at, format!("{command}: {text}")));
            } else if done {
                self.started = true;
            } else {
                return Err(Failure::Failed(format!("the module does not start the program: {text}")));
            }
        }
        if self.module.machine().is_none() {
            // Without power there are no answers.
            self.asked.clear();
        }
        Ok(())
    }

    fn take(&mut self, step: &Step) -> Result<(), Failure> {
        let at = step.at.saturating_sub(self.start);
        let executed = &step.executed;
        let opcode = Opcode::from_number(executed.command.opcode);
        self.counts.executed += 1;
        self.counts.last = Some(*step);
        if executed.refused.is_some() {
            self.counts.refused += 1;
            self.counts.first_refused.get_or_insert(*step);
        }
        if let Some(recording) = &mut self.recording {
            if executed.handler && !self.handler {
                recording.mark(at, Mark::Handler(executed.address));
            }
            if executed.refused.is_some() {
                recording.mark(at, Mark::Refused);
            }
            if opcode == Some(Opcode::Stop) {
                recording.mark(at, Mark::Stop);
            }
        }
        // Between two handlers the program has its turn, unless it is in a WAIT.
        self.handler = executed.handler && opcode != Some(Opcode::Reti);
        match &mut self.trace {
            Some(trace) => trace.step(at, step, self.program),
            None => Ok(()),
        }
    }

    fn sample(&mut self) {
        let at = self.time();
        if let Some(recording) = &mut self.recording {
            recording.sample(at, &self.module);
        }
    }
}
