//! The log of what goes over a link, from the host's side: the file of --log-telegrams.

use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use hal_sim::clock::Nanos;
use tmcl_tools::product::Product;
use tmcl_tools::wire::Tap;
use tmcm::can::Frame;
use tmcm_sim::Client;
use tmcm_sim::wire::{Place, Transcript};

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
        Ok(Log { file: self.clone(), transcript, place, begun: open.begun, at: None, failed: None })
    }

    /// Locks the log. A panic elsewhere does no harm to it.
    fn lock(&self) -> MutexGuard<'_, Option<Shared>> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The log of a link.
#[derive(Debug)]
pub(super) struct Log {
    file: LogFile,
    transcript: Transcript,
    place: Place,
    begun: Instant,
    /// The present, on a link with a clock of its own; `None` for the clock on the wall.
    at: Option<Duration>,
    /// Why something could not be written.
    failed: Option<Failure>,
}

impl Log {
    fn note(&mut self, what: impl FnOnce(&mut Transcript, Nanos, Place)) {
        let Log { file, transcript, place, begun, at, failed } = self;
        let at = at.unwrap_or_else(|| begun.elapsed());
        what(transcript, at.as_nanos() as Nanos, *place);
        if let Some(Shared { output, .. }) = &mut *file.lock()
            && let Err(error) = output.write_all(transcript.take().as_bytes()).and_then(|()| output.flush())
        {
            *failed = Some(error.into());
        }
    }
}

impl Tap for Log {
    fn at(&mut self, time: Duration) {
        self.at = Some(time);
    }

    fn out(&mut self, bytes: &[u8]) {
        self.note(|transcript, at, place| transcript.hear(at, place, bytes));
    }

    fn back(&mut self, bytes: &[u8]) {
        self.note(|transcript, at, place| transcript.answer(at, place, 0, bytes));
    }

    fn frame_out(&mut self, frame: &Frame) {
        self.note(|transcript, at, place| transcript.frame(at, place, None, frame));
    }

    fn frame_back(&mut self, frame: &Frame) {
        self.note(|transcript, at, place| transcript.frame(at, place, Some(0), frame));
    }

    fn give_up(&mut self) {
        self.note(|transcript, at, place| transcript.give_up(at, place, 0));
    }

    /// The file cannot be written.
    fn check(&mut self) -> Result<(), Box<dyn Error + Send + Sync>> {
        self.failed.take().map_or(Ok(()), |failure| Err(failure.into()))
    }
}

#[cfg(test)]
mod tests {
    use tmcm::tmcl::{Command, Reply, Status, binary};

    use super::*;

    /// A late reply stands in front of the next request, and what goes over another link is told apart in the same
    /// file.
    #[test]
    fn links_share_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        let file = LogFile::named(path.to_str().unwrap()).unwrap();
        let mut log = file.begin("serial", None).unwrap();
        let reply = |value| binary::encode_reply(2, 1, &Reply::Plain { status: Status::Ok, opcode: 6, value });
        let request = binary::encode_command(1, Command::new(6, 1, 0, 0));
        log.out(&request);
        log.give_up();
        log.back(&reply(1));
        log.out(&request);
        log.back(&reply(2));
        log.check().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let said: Vec<&str> = text.lines().map(|line| line[55..].trim()).collect();
        let late = "from 1: to command 6: 1, status 100 ok";
        assert_eq!(said, ["to 1: GAP 1, 0", "no reply", late, "to 1: GAP 1, 0", "from 1: 2, status 100 ok"]);
        let mut other = file.begin("serial", None).unwrap();
        other.at(Duration::ZERO);
        other.out(&request);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(
            text.lines().count() == 6 && text.contains(&format!("{:<8} >", Place::of("serial", Client(2)))),
            "{text}"
        );
    }
}
