//! The loop of `tmcl sim`.
//!
//! One thread runs everything. Each turn of the loop sleeps until bytes arrive or a module has something to do, and
//! lets virtual time pass up to the present. Then it takes the bytes that have arrived, and writes the replies that are
//! due. While time is paused, it passes for those who wait once their bytes have been taken.

use std::io::Write;
use std::time::{Duration, Instant};

use hal_sim::board::BoardKind;
use hal_sim::clock::SECOND;
use rustix::event::{PollFd, PollFlags, Timespec};
use tmcl_link::wording::words;
use tmcl_tools::desk::{ControllerId, Finished, Inquiries, Timekeeper, Told, carry_out};
use tmcm_sim::VirtualModule;
use tmcm_sim::fleet::{Fleet, Lost};

use crate::control::Controller;
use crate::ending::Ending;
use crate::factory::Factory;
use crate::failure::Failure;
use crate::links::Links;

/// The state of the running simulator.
pub(crate) struct Simulator<'a, M> {
    pub(crate) stop: Ending,
    pub(crate) factory: Factory<'a, M>,
    pub(crate) fleet: Fleet<M>,
    /// The boards of the modules, that of module 1 first.
    pub(crate) kinds: Vec<&'static BoardKind>,
    pub(crate) links: Links,
    pub(crate) timekeeper: Timekeeper,
    /// Commands to the firmware that have come to the control port.
    pub(crate) inquiries: Inquiries,
    /// Longest sleep while the modules have nothing to do for a host.
    pub(crate) nap: Duration,
    /// The file of --log-telegrams.
    pub(crate) telegrams: Option<Box<dyn Write>>,
    /// Tells a person something.
    pub(crate) say: fn(&str),
    /// The beginning from which the timekeeper counts.
    pub(crate) begun: Instant,
    /// Number of the last connection to the control port.
    pub(crate) last_controller: ControllerId,
}

impl<M: VirtualModule> Simulator<'_, M> {
    /// Runs until the end is asked for.
    ///
    /// # Errors
    /// A module cannot go on, or the system refuses to wait.
    pub(crate) fn run(mut self) -> Result<(), Failure> {
        while !self.sleep()? {
            let begun = self.begun;
            let clock = move || begun.elapsed();
            self.timekeeper.run(&mut self.fleet, self.links.controllers(), &clock);
            self.take_requests();
            self.restart()?;
            let finished = self.timekeeper.serve(&mut self.fleet, self.links.controllers(), &clock);
            // A reply is in the log before its host has it.
            self.log_telegrams()?;
            self.hand_out_replies(finished);
            self.report_messages();
            self.check()?;
        }
        self.log_telegrams()
    }

    /// Sleeps until bytes arrive or there is something to do. True if the program is to end.
    fn sleep(&mut self) -> Result<bool, Failure> {
        let mut wake = self.begun + self.timekeeper.wake(self.begun.elapsed(), &self.fleet, self.nap);
        wake = self.links.silence_ends().map_or(wake, |end| wake.min(end));
        if self.links.has_lines() {
            wake = Instant::now();
        }
        let timeout = Timespec::try_from(wake.saturating_duration_since(Instant::now())).ok();

        let interests = self.links.interests();
        let mut polled: Vec<PollFd<'_>> =
            self.stop.signs().map(|sign| PollFd::from_borrowed_fd(sign, PollFlags::IN)).collect();
        let signs = polled.len();
        polled.extend(interests.into_iter().map(|(fd, flags)| PollFd::from_borrowed_fd(fd, flags)));
        let signed = match rustix::event::poll(&mut polled, timeout.as_ref()) {
            Ok(_) => polled.iter().take(signs).any(|sign| !sign.revents().is_empty()),
            Err(rustix::io::Errno::INTR) => false,
            Err(error) => return Err(Failure::Failed(format!("cannot wait for the links: {}", words(error)))),
        };
        Ok(signed && self.stop.has_come())
    }

    /// Takes what has arrived on the links, but for what arrives during a step, and the lines at the control port.
    fn take_requests(&mut self) {
        if !self.timekeeper.is_stepping() {
            self.links.receive(&mut self.fleet).iter().for_each(|message| (self.say)(message));
        }
        // The control port is taken out of `links`, because its commands change the other links meanwhile.
        let mut control = self.links.control.take();
        if let Some(server) = &mut control {
            let last = &mut self.last_controller.0;
            let refused = server.accept(|stream| {
                *last += 1;
                Controller::new(ControllerId(*last), stream)
            });
            refused.iter().for_each(|message| (self.say)(message));
            for controller in &mut server.clients {
                controller.receive(|from, line| {
                    if self.timekeeper.is_paused() && !self.timekeeper.is_stepping() {
                        // A host may have written to a link before this line, after the link was looked at.
                        self.links.receive(&mut self.fleet).iter().for_each(|message| (self.say)(message));
                    }
                    let outcome = carry_out(
                        from,
                        line,
                        &self.kinds,
                        &mut self.fleet,
                        &mut self.timekeeper,
                        &mut self.inquiries,
                        self.begun.elapsed(),
                    );
                    // Lost bytes are removed before the answer is sent, because a host may send new bytes after the
                    // answer.
                    if !self.timekeeper.is_stepping() {
                        self.links.follow(&mut self.fleet).iter().for_each(|message| (self.say)(message));
                    }
                    outcome
                });
            }
        }
        self.links.control = control;
    }

    /// Puts new modules in the place of the old ones, if that was asked for. The links stay; what is on its way is
    /// lost.
    fn restart(&mut self) -> Result<(), Failure> {
        let Some(asker) = self.timekeeper.take_restart() else { return Ok(()) };
        self.log_telegrams()?;
        self.fleet = self.factory.anew(&mut self.fleet)?;
        if self.telegrams.is_some() {
            self.fleet.log_telegrams();
        }
        self.timekeeper = self.timekeeper.anew(self.begun.elapsed(), self.fleet.now());
        self.links.lose(Lost { usb: true, buses: true, hosts: false });
        // The cable is in again, and who reads the answer may open the port.
        self.links.follow(&mut self.fleet).iter().for_each(|message| (self.say)(message));
        let told = Told::time(self.fleet.now());
        self.links.controllers().iter_mut().for_each(|controller| controller.end_watch("restart"));
        self.inquiries.end().into_iter().for_each(|finished| self.answer(finished));
        self.answer((asker, Ok(Some(told))));
        Ok(())
    }

    /// Writes the lines of --log-telegrams since the last call.
    fn log_telegrams(&mut self) -> Result<(), Failure> {
        let Some(output) = &mut self.telegrams else { return Ok(()) };
        let lines = self.fleet.take_telegrams();
        if !lines.is_empty() {
            output.write_all(lines.as_bytes())?;
            output.flush()?;
        }
        Ok(())
    }

    /// Writes what the modules have sent, and after it the answers to what has been done meanwhile, or has ended.
    fn hand_out_replies(&mut self, finished: Option<Finished>) {
        if !self.timekeeper.is_stepping() {
            // The agenda may have changed the links meanwhile.
            self.links.follow(&mut self.fleet).iter().for_each(|message| (self.say)(message));
        }
        if !self.timekeeper.holds_replies() {
            self.links.send(&mut self.fleet);
            self.inquiries.finished(&mut self.fleet).into_iter().for_each(|finished| self.answer(finished));
        }
        finished.into_iter().for_each(|finished| self.answer(finished));
        for interrupter in self.timekeeper.take_interrupters() {
            let told = Told::time(self.fleet.now());
            self.answer((interrupter, Ok(Some(told))));
        }
        self.links.tidy(&mut self.fleet, self.timekeeper.is_at_rest());
    }

    /// Answers a connection, if it still is there.
    fn answer(&mut self, (asker, result): Finished) {
        if let Some(controller) = self.links.controllers().iter_mut().find(|controller| controller.id == asker) {
            controller.answer(result);
        }
    }

    fn report_messages(&mut self) {
        let several = self.fleet.modules().len() > 1;
        for (number, module) in (1..).zip(self.fleet.modules_mut()) {
            for message in module.take_log() {
                (self.say)(&if several { format!("module {number}: {message}") } else { message });
            }
        }
        if let Some((lag, achieved)) = self.timekeeper.lag() {
            let seconds = lag as f64 / SECOND as f64;
            (self.say)(&format!(
                "virtual time lags, it is {seconds:.1} s behind and goes at {achieved:.2} times the clock's pace"
            ));
        }
    }

    /// Ends the program if a module cannot go on.
    fn check(&self) -> Result<(), Failure> {
        let stopped = |(number, module): (usize, &M)| Some(format!("module {number} stopped: {}", module.stopped()?));
        (1..).zip(self.fleet.modules()).find_map(stopped).map_or(Ok(()), |why| Err(Failure::Failed(why)))
    }
}
