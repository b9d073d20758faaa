//! Pseudo terminals of Unix.

use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, OFlags};
use rustix::pty::OpenptFlags;
use rustix::termios::OptionalActions;
use tmcl_link::system::claim;
use tmcl_link::wording::words;

use crate::failure::Failure;
use crate::stream::Stream;

/// Whether there are pseudo terminals.
pub const EXIST: bool = true;

/// The simulator's end of a pseudo terminal.
pub type Master = File;

/// A pseudo terminal in raw mode.
#[derive(Debug)]
pub struct Pty<E> {
    /// The simulator's end of the link.
    pub end: E,
    device: PathBuf,
    link: Option<PathBuf>,
    /// Shows other simulators that the link's path is in use.
    _claim: Option<OwnedFd>,
    /// Shows the tools that the terminal leads to one module.
    _usb: Option<OwnedFd>,
    /// The terminal's device, kept open so that the terminal stays in raw mode while no host has the device open.
    _slave: OwnedFd,
}

impl<E> Pty<E> {
    /// Makes a pseudo terminal and, if `link` is given, a symbolic link to its device at that path. `option` is the
    /// option named in error messages.
    pub fn open(option: &str, link: Option<&Path>, end: impl FnOnce(Stream<Master>) -> E) -> Result<Self, Failure> {
        let claim = link.map(|link| reserve(option, link)).transpose()?;
        Vacant { link: link.map(Path::to_path_buf), claim, failing: false }.occupy(option, end)
    }

    /// The same terminal as the end of a USB cable: it leads to one module, which answers whatever the address.
    pub fn of_usb(mut self) -> Self {
        // Without the claim the tools look at the addresses in replies, as on a bus.
        self._usb = claim::usb(&self.device).ok();
        self
    }

    /// Hangs up: who has the terminal open sees its end, and the symbolic link is gone. The link's path stays claimed.
    pub fn hang_up(mut self) -> Vacant {
        self.remove_link();
        Vacant { link: self.link.take(), claim: self._claim.take(), failing: false }
    }

    /// Removes the symbolic link, unless it points to another device by now.
    fn remove_link(&self) {
        if let Some(link) = &self.link
            && fs::read_link(link).is_ok_and(|target| target == self.device)
        {
            // A link that cannot be removed does no harm: the next run replaces it.
            let _ = fs::remove_file(link);
        }
    }

    /// Path of the terminal's device.
    pub fn device(&self) -> &Path {
        &self.device
    }

    /// The path that host software opens: the symbolic link if there is one, else the device.
    pub fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.device)
    }
}

impl<E> Drop for Pty<E> {
    fn drop(&mut self) {
        self.remove_link();
    }
}

/// The place of a pseudo terminal that has hung up, or is not there yet.
#[derive(Debug)]
pub struct Vacant {
    link: Option<PathBuf>,
    claim: Option<OwnedFd>,
    /// The last attempt to make a pseudo terminal has failed.
    failing: bool,
}

impl Vacant {
    /// The same as [`Vacant::occupy`], again and again until it succeeds: `None` where it has failed once more.
    pub fn try_to_occupy<E>(
        &mut self,
        option: &str,
        end: impl FnOnce(Stream<Master>) -> E,
    ) -> Option<Result<Pty<E>, Failure>> {
        let occupied = self.occupy(option, end);
        let known = std::mem::replace(&mut self.failing, occupied.is_err());
        (occupied.is_ok() || !known).then_some(occupied)
    }

    /// Makes a pseudo terminal in this place, with the symbolic link that belongs there. If that fails, the place stays
    /// vacant.
    ///
    /// # Errors
    /// There is something else at the path of the link, or there are no terminals any more.
    pub fn occupy<E>(&mut self, option: &str, end: impl FnOnce(Stream<Master>) -> E) -> Result<Pty<E>, Failure> {
        let (master, slave, device) =
            terminal().map_err(|error| Failure::Failed(format!("cannot make a pseudo terminal: {}", words(error))))?;
        if let Some(link) = &self.link {
            make_symlink(option, link, &device)?;
        }
        // While one telegram waits for a host that does not read, further replies are lost, as on a wire.
        let stream = Stream::new(File::from(master), 1);
        Ok(Pty {
            end: end(stream),
            device,
            link: self.link.take(),
            _claim: self.claim.take(),
            _usb: None,
            _slave: slave,
        })
    }
}

/// Makes a pseudo terminal in raw mode; gives its two ends, the simulator's one non-blocking, and its device's path.
fn terminal() -> io::Result<(OwnedFd, OwnedFd, PathBuf)> {
    let master = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    rustix::pty::grantpt(&master)?;
    rustix::pty::unlockpt(&master)?;
    let name = rustix::pty::ptsname(&master, Vec::new())?;
    let device = PathBuf::from(name.to_string_lossy().into_owned());
    let slave = rustix::fs::open(&device, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
    let mut settings = rustix::termios::tcgetattr(&slave)?;
    settings.make_raw();
    rustix::termios::tcsetattr(&slave, OptionalActions::Now, &settings)?;
    let flags = rustix::fs::fcntl_getfl(&master)?;
    rustix::fs::fcntl_setfl(&master, flags | OFlags::NONBLOCK)?;
    Ok((master, slave, device))
}

/// Claims the path of a symbolic link, if the link could be made there.
fn reserve(option: &str, link: &Path) -> Result<OwnedFd, Failure> {
    is_leftover(option, link)?;
    claim::path(link).map_err(|error| match error.kind() {
        ErrorKind::AddrInUse => Failure::Failed(format!(
            "{option}: {} is the port of a simulator that runs. Give another path",
            link.display()
        )),
        _ => no_link(option, link, error),
    })
}

/// Makes the symbolic link at a path that is claimed. The link of a simulator that has ended is replaced; any other
/// file is an error.
fn make_symlink(option: &str, link: &Path, device: &Path) -> Result<(), Failure> {
    if is_leftover(option, link)? {
        fs::remove_file(link).map_err(|error| {
            let shown = link.display();
            Failure::Failed(format!("{option}: cannot replace the old link {shown}: {}", words(error)))
        })?;
    }
    std::os::unix::fs::symlink(device, link).map_err(|error| no_link(option, link, error))
}

/// True if there is a link to a terminal at a path, false if there is nothing; any other file is an error.
fn is_leftover(option: &str, link: &Path) -> Result<bool, Failure> {
    let Ok(found) = fs::symlink_metadata(link) else { return Ok(false) };
    if found.is_symlink() && fs::read_link(link).is_ok_and(|target| claim::is_pseudo_terminal(&target)) {
        return Ok(true);
    }
    Err(Failure::Failed(format!(
        "{option}: {} exists and is not a link to a terminal; it is left alone. Give a path where there is nothing yet",
        link.display()
    )))
}

fn no_link(option: &str, link: &Path, error: io::Error) -> Failure {
    let shown = link.display();
    Failure::Failed(format!("{option}: cannot make a link at {shown}: {}. Its directory has to exist", words(error)))
}
