//! The program on a pseudo terminal, as somebody has it who types.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::process::{Child, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec};
use rustix::fs::{Mode, OFlags};
use rustix::process::{Pid, Signal};
use rustix::pty::OpenptFlags;
use rustix::termios::{Termios, Winsize};

use super::harness::{PATIENCE, command, tmcl_path};

/// Both sides of a pseudo terminal with so many columns: that where somebody types, and that of a program.
pub(crate) fn pair(columns: u16) -> (OwnedFd, OwnedFd) {
    let master = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
    rustix::pty::grantpt(&master).unwrap();
    rustix::pty::unlockpt(&master).unwrap();
    let name = rustix::pty::ptsname(&master, Vec::new()).unwrap();
    let slave = rustix::fs::open(&name, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty()).unwrap();
    let size = Winsize { ws_row: 24, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
    rustix::termios::tcsetwinsize(&slave, size).unwrap();
    (master, slave)
}

/// The program on a terminal of its own.
pub(crate) struct Terminal {
    child: Child,
    /// The side where somebody types and reads; `None` once the terminal is gone.
    master: Option<File>,
    /// The program's side, kept open so that the settings can be read after the program has ended.
    slave: Option<OwnedFd>,
    /// The settings before the program began.
    settings: Termios,
    /// The text that the program has shown and nobody has waited for.
    shown: String,
}

impl Terminal {
    /// Starts the program with these arguments on a terminal with 80 columns.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        Self::start_with(arguments, 80)
    }

    /// The same, with so many columns.
    pub(crate) fn start_with(arguments: &[&str], columns: u16) -> Self {
        Self::start_in(arguments, columns, &[("NO_COLOR", "1")])
    }

    /// The same, with these variables in the environment.
    pub(crate) fn start_in(arguments: &[&str], columns: u16, variables: &[(&str, &str)]) -> Self {
        let (master, slave) = pair(columns);
        let settings = rustix::termios::tcgetattr(&slave).unwrap();
        let side = || Stdio::from(slave.try_clone().unwrap());
        // setsid makes this the controlling terminal of the program, which it becomes: Ctrl-C is a signal, and so is
        // the end of the terminal.
        let mut command = command("setsid");
        command.args(["--ctty", tmcl_path()]).args(arguments).env("TERM", "xterm").env_remove("NO_COLOR");
        // In a log of CI colours are taken to be seen, whatever the terminal.
        command.env_remove("CI");
        command.envs(variables.iter().copied());
        let child = command.stdin(side()).stdout(side()).stderr(side()).spawn().unwrap();
        Terminal { child, master: Some(master.into()), slave: Some(slave), settings, shown: String::new() }
    }

    /// Types keys.
    pub(crate) fn keys(&mut self, keys: &str) {
        self.master.as_mut().unwrap().write_all(keys.as_bytes()).unwrap();
    }

    /// Types a line.
    pub(crate) fn line(&mut self, line: &str) {
        self.keys(&format!("{line}\r"));
    }

    /// Waits until the program has shown a text, and gives all that it has shown up to there since the last time.
    pub(crate) fn expect(&mut self, text: &str) -> String {
        let end = Instant::now() + PATIENCE;
        loop {
            if let Some(at) = self.shown.find(text) {
                let rest = self.shown.split_off(at + text.len());
                return std::mem::replace(&mut self.shown, rest);
            }
            assert!(Instant::now() < end, "'{text}' is not in\n{}", self.shown);
            let open = self.look(Duration::from_millis(100));
            assert!(open || self.shown.contains(text), "it has ended without '{text}':\n{}", self.shown);
        }
    }

    /// True if the program has shown a text since the last one that was waited for.
    pub(crate) fn shows(&mut self, text: &str) -> bool {
        self.look(Duration::ZERO);
        self.shown.contains(text)
    }

    /// Takes what the program shows within a time. False once the program has closed the terminal.
    fn look(&mut self, within: Duration) -> bool {
        let master = self.master.as_mut().unwrap();
        let timeout = Timespec { tv_sec: 0, tv_nsec: within.subsec_nanos().into() };
        if rustix::event::poll(&mut [PollFd::new(&*master, PollFlags::IN)], Some(&timeout)).unwrap() == 0 {
            // This side keeps the terminal open, so a program that has ended shows only in its process.
            return self.child.try_wait().unwrap().is_none();
        }
        let mut bytes = [0; 4096];
        match master.read(&mut bytes) {
            Ok(count @ 1..) => {
                self.shown += &String::from_utf8_lossy(&bytes[..count]);
                true
            }
            Ok(_) | Err(_) => false,
        }
    }

    /// The process of the program.
    pub(crate) fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// Sends a signal.
    pub(crate) fn signal(&self, signal: Signal) {
        rustix::process::kill_process(self.pid(), signal).unwrap();
    }

    /// True if the terminal has the settings that it had before the program began.
    pub(crate) fn is_as_before(&self) -> bool {
        let now = rustix::termios::tcgetattr(self.slave.as_ref().unwrap().as_fd()).unwrap();
        format!("{now:?}") == format!("{:?}", self.settings)
    }

    /// Takes the terminal away, as a window that is closed.
    pub(crate) fn hang_up(&mut self) {
        self.slave = None;
        self.master = None;
    }

    /// Waits for the end of the program, and gives all that it has shown since the last time.
    pub(crate) fn end(&mut self) -> (ExitStatus, String) {
        let end = Instant::now() + PATIENCE;
        loop {
            if self.master.is_some() {
                self.look(Duration::from_millis(20));
            }
            std::thread::sleep(Duration::from_millis(1));
            if let Some(status) = self.child.try_wait().unwrap() {
                while self.master.is_some() && self.look(Duration::ZERO) {}
                return (status, std::mem::take(&mut self.shown));
            }
            assert!(Instant::now() < end, "it goes on:\n{}", self.shown);
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
