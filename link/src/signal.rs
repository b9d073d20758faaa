//! Signals that ask the program to end, as a descriptor that can be polled.

use std::io::Read;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use tmcl_tools::stop::Stop;

use crate::Error;
use crate::poll::readable;
use crate::wording::words;

/// A file descriptor that can be read once one of the signals has come: Ctrl-C (SIGINT), SIGTERM, or SIGHUP, which tells
/// that the terminal is gone.
#[derive(Debug)]
pub struct EndSignal {
    /// Can be read once a signal has come.
    bell: UnixStream,
    /// The number of the last signal.
    caught: Arc<AtomicUsize>,
}

/// The number of the last signal since somebody began to wait for something else than the bell; 0 is none.
static LAST: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);

/// A wait for something else than a signal, in which signals that come are noticed.
#[derive(Clone, Copy, Debug)]
pub struct Wait(());

impl Wait {
    /// The wait begins: signals that came before do not count.
    pub fn begin() -> Self {
        LAST.store(0, Ordering::SeqCst);
        Wait(())
    }

    /// The number of a signal that has come meanwhile.
    pub fn signal(self) -> Option<u8> {
        u8::try_from(LAST.load(Ordering::SeqCst)).ok().filter(|signal| *signal != 0)
    }
}

impl EndSignal {
    /// Watches for these signals, which from now on no longer end the program by themselves. SIGHUP is left alone if the
    /// program was started with it ignored, as `nohup` does.
    ///
    /// # Errors
    /// The system refuses to watch for a signal.
    pub fn watch() -> Result<Self, Error> {
        Self::register().map_err(|error| Error(format!("cannot watch for signals: {}", words(error))))
    }

    fn register() -> std::io::Result<Self> {
        let (bell, rope) = UnixStream::pair()?;
        bell.set_nonblocking(true)?;
        let caught = Arc::<AtomicUsize>::default();
        let hangup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
        for signal in [SIGINT, SIGTERM].into_iter().chain(hangup) {
            // The number is noted before the bell rings, because handlers run in the order of their registration.
            signal_hook::flag::register_usize(signal, Arc::clone(&caught), signal.unsigned_abs() as usize)?;
            signal_hook::flag::register_usize(signal, Arc::clone(&LAST), signal.unsigned_abs() as usize)?;
            signal_hook::low_level::pipe::register(signal, rope.try_clone()?)?;
        }
        Ok(EndSignal { bell, caught })
    }

    /// True if the signal that has come is Ctrl-C, after which an interactive program may go on.
    pub fn is_interrupt(&self) -> bool {
        self.caught.load(Ordering::SeqCst) == SIGINT as usize
    }
}

impl Stop for EndSignal {
    fn forget(&self) {
        let mut rings = [0; 64];
        while (&self.bell).read(&mut rings).is_ok_and(|count| count > 0) {}
        self.caught.store(0, Ordering::SeqCst);
    }

    /// Without a signal the descriptor has failed, and it is as if the user had ended the program.
    fn signal(&self) -> u8 {
        let signal = u8::try_from(self.caught.load(Ordering::SeqCst)).ok().filter(|signal| *signal != 0);
        signal.unwrap_or(SIGINT as u8)
    }

    fn within(&self, time: Duration) -> bool {
        // If the descriptor cannot be polled, the loops that call this would never end; so an error counts as a signal.
        readable(&self.bell, Instant::now() + time).unwrap_or(true)
    }
}

impl AsFd for EndSignal {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.bell.as_fd()
    }
}

/// True if the program was started with this signal ignored: the signal must not end it.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask >> (signal - 1) & 1 != 0)
}
