//! Signals that ask the program to end, as something that can be waited for.

use std::io::Read;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

use rustix::fd::{AsFd, BorrowedFd};
use tmcl_tools::stop::Stop;

use crate::Error;
use crate::number::INTERRUPT;
use crate::poll::readable;
use crate::system::{self, Socket};
use crate::wording::words;

/// A bell that rings once one of these signals has come: it can be read then.
#[derive(Debug)]
pub struct EndSignal {
    /// Can be read once a signal has come.
    bell: Socket,
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
    /// Watches for these signals, which from now on no longer end the program by themselves. SIGHUP is left alone if
    /// the program was started with it ignored, as `nohup` does.
    ///
    /// # Errors
    /// The system refuses to watch for a signal.
    pub fn watch() -> Result<Self, Error> {
        Self::register().map_err(|error| Error(format!("cannot watch for signals: {}", words(error))))
    }

    fn register() -> std::io::Result<Self> {
        let (bell, rope) = system::pair()?;
        bell.set_nonblocking(true)?;
        let caught = Arc::<AtomicUsize>::default();
        system::watch(&rope, &[Arc::clone(&caught), Arc::clone(&LAST)])?;
        Ok(EndSignal { bell, caught })
    }

    /// True if the signal that has come is Ctrl-C, after which an interactive program may go on.
    pub fn is_interrupt(&self) -> bool {
        self.caught.load(Ordering::SeqCst) == usize::from(INTERRUPT)
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
        signal.unwrap_or(INTERRUPT)
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
