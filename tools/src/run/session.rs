//! The run itself: lets virtual time pass, applies the events of option `--at`, and feeds trace, recording and report.

use std::collections::VecDeque;

use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::control::Control;
use tmcm::module::Source;
use tmcm::tmcl::binary;
use tmcm::tmcl::{Command, Opcode};
use tmcm_sim::tracer::Step;
use tmcm_sim::wire::stays_unanswered;
use tmcm_sim::wire::words::{self, Meaning};
use tmcm_sim::{NativeModule, VirtualModule};

use super::host;
use super::mishap::Mishaps;
use super::recording::{Mark, Recording};
use super::script::{Action, Event};
use super::trace::Trace;
use crate::failure::Failure;
use crate::product::{Product, read_unit_mode};
use crate::program::Program;
use crate::progress::Progress;
use crate::stop::Stop;

/// Interval at which values are recorded, in virtual time.
const TICK: Nanos = MILLISECOND;
/// Number of ticks between two checks for signals and for the progress bar.
const LOOK: u64 = 64;

/// The reason why a run is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The program has ended, and no event is left.
    Program,
    /// The time of option `--until` has been reached.
    Time,
    /// The run has been asked to end.
    Signal,
}

/// Counts of executed commands.
#[derive(Clone, Debug, Default)]
pub(super) struct Counts {
    /// Number of executed commands.
    pub(super) executed: u64,
    /// The mishaps of the program.
    pub(super) mishaps: Mishaps,
    /// The last executed command.
    pub(super) last: Option<Step>,
}

/// A program that runs in a virtual module.
pub struct Session<'a> {
    /// The module.
    pub module: NativeModule,
    program: &'a Program,
    events: VecDeque<Event>,
    trace: Option<Trace<'a>>,
    /// The recording for the plot, if one is wanted.
    pub recording: Option<Recording>,
    /// When the program was started, in virtual time.
    pub(super) start: Nanos,
    /// Virtual time that has passed since the start.
    reached: Nanos,
    /// True if the last executed command belonged to an interrupt handler.
    in_handler: bool,
    pub(super) counts: Counts,
    /// Applied events and answered commands of the host as text, with their times since the start.
    pub(super) notes: Vec<(Nanos, String)>,
    /// Commands of the host that have not been answered, with the times at which they were sent.
    asked: VecDeque<(Nanos, Command)>,
    /// True once the module has answered the command that starts the program.
    started: bool,
}

impl<'a> Session<'a> {
    /// A session with the program downloaded, ready to be started.
    ///
    /// # Errors
    /// The module does not take the program.
    pub fn new(
        mut module: NativeModule,
        program: &'a Program,
        events: Vec<Event>,
        trace: Option<Trace<'a>>,
        recording: Option<Recording>,
    ) -> Result<Self, Failure> {
        host::download(&mut module, program)?;
        module.trace(true);
        // The start is moved to the firmware's next millisecond, so that times in trace and plot are round numbers.
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
            in_handler: false,
            counts: Counts::default(),
            notes: Vec::new(),
            asked: VecDeque::new(),
            started: false,
        })
    }

    /// The product that the module is.
    pub(super) fn product(&self) -> Product {
        self.module.model().product()
    }

    /// Virtual time since the start of the program, in nanoseconds.
    pub(super) fn time(&self) -> Nanos {
        self.reached
    }

    /// Runs the program from address 0 on until it has ended and no event is left, or until the time `end`.
    ///
    /// # Errors
    /// The module does not start it, a change of the world is not possible, or the trace cannot be written.
    pub fn run(&mut self, end: Nanos, stop: &dyn Stop, progress: &mut dyn FnMut(Progress<'_>)) -> Result<End, Failure> {
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
                if stop.happened() {
                    return self.finish(End::Signal);
                }
                let total = (end / TICK) as usize;
                progress(Progress { what: "running the program", done: tick as usize, total });
            }
        }
        self.finish(End::Time)
    }

    fn finish(&mut self, end: End) -> Result<End, Failure> {
        self.trace.take().map_or(Ok(()), Trace::finish)?;
        Ok(end)
    }

    /// True if the program has ended, all events have been applied, and the host has its answers.
    fn is_over(&self) -> bool {
        let runs = self.module.machine().is_some_and(|machine| machine.runs());
        !runs && self.events.is_empty() && self.asked.is_empty()
    }

    /// Lets virtual time pass until `to`, and applies the events that are due before.
    fn advance(&mut self, to: Nanos) -> Result<(), Failure> {
        while let Some(event) = self.events.pop_front_if(|event| event.at < to) {
            self.run_module(event.at)?;
            self.apply(&event)?;
        }
        self.run_module(to)
    }

    fn run_module(&mut self, to: Nanos) -> Result<(), Failure> {
        self.module.run_until(self.start + to);
        self.reached = to;
        self.collect()
    }

    fn apply(&mut self, event: &Event) -> Result<(), Failure> {
        match event.action {
            Action::World(Control::Power { on }) => self.module.set_power(on),
            Action::World(control) => {
                control.apply(&mut self.module.board().borrow_mut()).map_err(Failure::Failed)?;
            }
            Action::Host(command) => self.send(command),
        }
        if let Some(recording) = &mut self.recording {
            recording.notes.push((event.at, event.text.clone()));
        }
        match event.action {
            // A command that is answered is noted with its answer.
            Action::Host(command) if !stays_unanswered(command) => {}
            _ => self.notes.push((event.at, event.text.clone())),
        }
        match &mut self.trace {
            Some(trace) => trace.note(event.at, &event.text),
            None => Ok(()),
        }
    }

    fn send(&mut self, command: Command) {
        if !stays_unanswered(command) && self.module.machine().is_some() {
            self.asked.push_back((self.time(), command));
        }
        self.module.receive(Source::Usb, binary::encode_command(host::ADDRESS, command));
    }

    /// Takes the commands that the program has executed and the answers that have come since the last call.
    fn collect(&mut self) -> Result<(), Failure> {
        for step in self.module.take_steps() {
            self.take(&step)?;
        }
        while let Some(sent) = self.module.sent() {
            let Some(((at, command), reply)) = self.asked.pop_front().zip(sent.telegram()) else { continue };
            let product = Some(self.product());
            let mode = read_unit_mode(product, command.motor).and_then(|command| self.module.read(command));
            let Meaning { text, done } = words::meaning(product, mode == Some(0), command, &reply);
            if self.started {
                self.notes.push((at, format!("{command}: {text}")));
            } else if done {
                self.started = true;
            } else {
                return Err(Failure::Failed(format!("the module does not start the program: {text}")));
            }
        }
        if self.module.machine().is_none() {
            // A module without power does not answer.
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
        self.counts.mishaps.take(step, self.program);
        if let Some(recording) = &mut self.recording {
            if executed.handler && !self.in_handler {
                recording.mark(at, Mark::Handler(executed.address));
            }
            if executed.refused.is_some() {
                recording.mark(at, Mark::Refused);
            }
            if opcode == Some(Opcode::Stop) {
                recording.mark(at, Mark::Stop);
            }
        }
        // RETI ends a handler; if the program is in a WAIT, the next handler may follow directly and is marked, too.
        self.in_handler = executed.handler && opcode != Some(Opcode::Reti);
        match &mut self.trace {
            Some(trace) => trace.step(at, step, self.program),
            None => Ok(()),
        }
    }

    fn sample(&mut self) {
        let at = self.time();
        if let Some(recording) = &mut self.recording {
            recording.sample(at, &mut self.module);
        }
    }
}
