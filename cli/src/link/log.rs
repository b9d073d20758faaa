//! The log of what goes over a link, from the host's side: the file of --log-telegrams.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use hal_sim::clock::Nanos;
use tmcl_tools::product::Product;
use tmcm::can::Frame;
use tmcm_sim::Client;
use tmcm_sim::wire::{Place, Transcript};

use super::LinkError;
use crate::failure::Failure;
use crate::output::Output;

/// The option, in messages.
const OPTION: &str = "--log-telegrams";

/// A file for the log, which is opened with the first link. All links that are opened with it share it.
#[derive(Clone, Debug)]
pub struct LogFile {
    path: PathBuf,
    shared: Arc<Mutex<Option<Shared>>>,
}

#[derive(Debug)]
struct Shared {
    output: Output,
    /// When the file was opened.
    begun: Instant,
    /// Number of links that have been opened with it.
    links: u64,
}

impl LogFile {
    /// A log with this path, or standard output for `-`. Nothing is opened yet.
    ///
    /// # Errors
    /// None.
    pub fn named(path: &str) -> Result<Self, std::convert::Infallible> {
        Ok(LogFile { path: Path::new(path).into(), shared: Arc::default() })
    }

    /// The log of one more link, which has this name. A file that exists is emptied by the first one.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn begin(&self, link: &'static str, product: Option<Product>) -> Result<Log, Failure> {
        let mut shared = self.lock();
        let open = match shared.take() {
            Some(open) => open,
            None => Shared { output: Output::stream(OPTION, &self.path)?, begun: Instant::now(), links: 0 },
        };
        let open = shared.insert(open);
        open.links += 1;
        let place = if open.links == 1 { Place::alone(link) } else { Place::of(link, Client(open.links)) };
        let transcript = Transcript::of_module(product);
        Ok(Log(Some(Entries { file: self.clone(), transcript, place, begun: open.begun, failed: None })))
    }

    /// What panics elsewhere does no harm to the log.
    fn lock(&self) -> MutexGuard<'_, Option<Shared>> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The log of a link; without a file it takes everything and does nothing.
#[derive(Debug, Default)]
pub(super) struct Log(Option<Entries>);

#[derive(Debug)]
struct Entries {
    file: LogFile,
    transcript: Transcript,
    place: Place,
    begun: Instant,
    /// Why something could not be written.
    failed: Option<Failure>,
}

impl Log {
    /// Time since the log was begun, by the clock on the wall.
    pub(super) fn now(&self) -> Duration {
        self.0.as_ref().map_or(Duration::ZERO, |entries| entries.begun.elapsed())
    }

    /// Bytes go out.
    pub(super) fn out(&mut self, at: Duration, bytes: &[u8]) {
        self.note(at, |transcript, at, place| transcript.hear(at, place, bytes));
    }

    /// Bytes have come.
    pub(super) fn back(&mut self, at: Duration, bytes: &[u8]) {
        self.note(at, |transcript, at, place| transcript.answer(at, place, 0, bytes));
    }

    /// A frame goes out.
    pub(super) fn frame_out(&mut self, frame: &Frame) {
        self.note(self.now(), |transcript, at, place| transcript.frame(at, place, None, frame));
    }

    /// A frame has come.
    pub(super) fn frame_back(&mut self, frame: &Frame) {
        self.note(self.now(), |transcript, at, place| transcript.frame(at, place, Some(0), frame));
    }

    /// No reply has come in time, or not all of it.
    pub(super) fn give_up(&mut self, at: Duration) {
        self.note(at, |transcript, at, place| transcript.give_up(at, place, 0));
    }

    /// What has gone wrong with the file since the last call.
    pub(super) fn check(&mut self) -> Result<(), LinkError> {
        let failed = self.0.as_mut().and_then(|entries| entries.failed.take());
        failed.map_or(Ok(()), |failure| Err(LinkError::Log(Box::new(failure))))
    }

    fn note(&mut self, at: Duration, what: impl FnOnce(&mut Transcript, Nanos, Place)) {
        let Some(Entries { file, transcript, place, failed, .. }) = &mut self.0 else { return };
        what(transcript, at.as_nanos() as Nanos, *place);
        if let Some(Shared { output, .. }) = &mut *file.lock()
            && let Err(failure) = output.write(transcript.take().as_bytes()).and_then(|()| output.flush())
        {
            *failed = Some(failure);
        }
    }
}
