//! A running `tmcl sim`, and what talks to it.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Output, Stdio};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, LazyLock, Once, mpsc};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec};
use rustix::process::{Pid, Signal};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use tmcm::tmcl::binary::{self, Received, TELEGRAM, Telegram};
use tmcm::tmcl::text;

/// Longest time a test waits for anything; a busy computer is slow.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);
/// A silence that ends an unfinished telegram, however busy the computer.
pub(crate) const SILENCE: Duration = Duration::from_millis(300);

/// The variable that names another program to be tested in place of the one that was built together with the tests.
pub(crate) const PROGRAM: &str = "TMCL_PROGRAM";

/// Where the program is.
pub(crate) fn tmcl_path() -> &'static str {
    static PATH: LazyLock<String> = LazyLock::new(|| {
        let built = || xtask::programs().unwrap().join("tmcl").to_str().unwrap().into();
        std::env::var(PROGRAM).unwrap_or_else(|_| built())
    });
    &PATH
}

/// The program with these arguments.
pub(crate) fn tmcl(arguments: &[&str]) -> Command {
    let mut command = command(tmcl_path());
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Any program that a test starts. Signals that end it do so even if whoever started the tests ignores them, as `nohup`
/// does, and a shell for what it starts with `&`.
pub(crate) fn command(program: &str) -> Command {
    static HEARD: Once = Once::new();
    HEARD.call_once(|| {
        for (name, signal) in [("HUP", SIGHUP), ("INT", SIGINT), ("TERM", SIGTERM)] {
            // A shell lives on if it has inherited that the signal is ignored.
            let is_ignored = Command::new("sh").args(["-c", &format!("kill -{name} $$")]).status().unwrap().success();
            if is_ignored {
                // What is handled here, and be it by nothing, is not ignored in programs started from here.
                signal_hook::flag::register(signal, Arc::<AtomicBool>::default()).unwrap();
            }
        }
    });
    Command::new(program)
}

/// Runs the program to its end.
pub(crate) fn run(arguments: &[&str]) -> Output {
    tmcl(arguments).output().unwrap()
}

/// Runs the program to its end with this standard input.
pub(crate) fn type_into(arguments: &[&str], text: &str) -> Output {
    let mut child = tmcl(arguments).stdin(Stdio::piped()).spawn().unwrap();
    // A program that has had enough does not read the rest.
    let _ = child.stdin.take().unwrap().write_all(text.as_bytes());
    child.wait_with_output().unwrap()
}

/// The text that a program that ended wrote to its standard error.
pub(crate) fn complaint(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A request in mnemonic form.
pub(crate) fn request(line: &str) -> Telegram {
    binary::encode_command(1, text::parse(line).unwrap())
}

/// A running virtual module, and a folder of its own.
pub(crate) struct Sim {
    child: Child,
    told: HashMap<String, String>,
    pub(crate) folder: tempfile::TempDir,
}

impl Sim {
    /// Starts a module; `{}` in an argument stands for its folder.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        Self::start_in(tempfile::tempdir().unwrap(), arguments)
    }

    /// Starts a module in a folder that exists.
    pub(crate) fn start_in(folder: tempfile::TempDir, arguments: &[&str]) -> Self {
        Self::start_saying(folder, arguments, Stdio::inherit())
    }

    /// The same, with its messages going to `messages`.
    pub(crate) fn start_saying(folder: tempfile::TempDir, arguments: &[&str], messages: Stdio) -> Self {
        let path = folder.path().to_str().unwrap();
        let arguments: Vec<String> = arguments.iter().map(|argument| argument.replace("{}", path)).collect();
        Self::start_as(folder, tmcl(&["sim"]).args(arguments).stderr(messages))
    }

    /// Starts a module by a command of one's own; its standard output is a pipe.
    pub(crate) fn start_as(folder: tempfile::TempDir, command: &mut Command) -> Self {
        let child = command.spawn().unwrap();
        let mut sim = Sim { child, told: HashMap::new(), folder };
        let (sender, lines) = mpsc::channel();
        let stdout = sim.child.stdout.take().unwrap();
        std::thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                let _ = sender.send(line);
            }
        });
        loop {
            let line = lines.recv_timeout(PATIENCE).expect("not ready");
            if line == "ready" {
                return sim;
            }
            if let Some((name, value)) = line.split_once(": ") {
                sim.told.insert(name.into(), value.into());
            }
        }
    }

    /// Where it says it listens.
    pub(crate) fn told(&self, link: &str) -> &str {
        &self.told[link]
    }

    /// A path in its folder.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A new connection to its TCP port.
    pub(crate) fn tcp(&self) -> Host<TcpStream> {
        let stream = TcpStream::connect(self.told("tcp")).unwrap();
        stream.set_nodelay(true).unwrap();
        Host(stream)
    }

    /// Opens its serial port, as plain as can be.
    pub(crate) fn serial(&self) -> Host<File> {
        Host(OpenOptions::new().read(true).write(true).open(self.told("serial")).unwrap())
    }

    /// Carries out lines of the control protocol and gives the last answer.
    pub(crate) fn control(&self, lines: &[&str]) -> serde_json::Value {
        let mut stream = TcpStream::connect(self.told("control")).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut answers = BufReader::new(stream.try_clone().unwrap()).lines();
        let mut last = serde_json::Value::Null;
        for line in lines {
            stream.write_all(format!("{line}\n").as_bytes()).unwrap();
            last = serde_json::from_str(&answers.next().unwrap().unwrap()).unwrap();
        }
        last
    }

    /// Waits until it has read all that its links have brought: it looks at each of them before it answers twice.
    pub(crate) fn has_looked(&self) {
        self.control(&["state", "state"]);
    }

    /// The process of the simulator.
    pub(crate) fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// The standard input of the simulator, if that is a pipe.
    pub(crate) fn stdin(&mut self) -> ChildStdin {
        self.child.stdin.take().unwrap()
    }

    /// Sends a signal.
    pub(crate) fn signal(&self, signal: Signal) {
        rustix::process::kill_process(self.pid(), signal).unwrap();
    }

    /// Sends a signal and waits for the end.
    pub(crate) fn end(self, signal: Signal) -> (ExitStatus, tempfile::TempDir) {
        self.signal(signal);
        self.wait()
    }

    /// Waits for the end.
    pub(crate) fn wait(mut self) -> (ExitStatus, tempfile::TempDir) {
        let latest = Instant::now() + PATIENCE;
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(Instant::now() < latest, "it goes on");
            std::thread::sleep(Duration::from_millis(5));
        };
        let folder = std::mem::replace(&mut self.folder, tempfile::tempdir().unwrap());
        (status, folder)
    }
}

impl Drop for Sim {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A connection to the control port.
pub(crate) struct Controller {
    pub(crate) stream: TcpStream,
    pub(crate) answers: BufReader<TcpStream>,
}

impl Controller {
    pub(crate) fn new(sim: &Sim) -> Self {
        let stream = TcpStream::connect(sim.told("control")).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Controller { answers: BufReader::new(stream.try_clone().unwrap()), stream }
    }

    /// The next line; none when the connection is closed.
    pub(crate) fn answer(&mut self) -> Option<serde_json::Value> {
        let mut line = String::new();
        (self.answers.read_line(&mut line).unwrap() > 0).then(|| serde_json::from_str(&line).unwrap())
    }

    /// Sends a line, or several.
    pub(crate) fn tell(&mut self, line: &str) {
        self.stream.write_all(format!("{line}\n").as_bytes()).unwrap();
    }

    /// Sends a line and takes the answer.
    pub(crate) fn ask(&mut self, line: &str) -> serde_json::Value {
        self.tell(line);
        self.answer().unwrap()
    }

    /// Sends a line that must be carried out, and takes the answer.
    pub(crate) fn ok(&mut self, line: &str) -> serde_json::Value {
        let answer = self.ask(line);
        assert_eq!(answer["ok"], true, "{line}: {answer}");
        answer
    }

    /// The answer to a line that is refused.
    pub(crate) fn refused(&mut self, line: &str) -> String {
        let answer = self.ask(line);
        assert_eq!(answer["ok"], false, "{line}");
        answer["error"].as_str().unwrap().to_owned()
    }

    /// Virtual time in microseconds.
    pub(crate) fn time(&mut self) -> u64 {
        self.ok("state")["time_us"].as_u64().unwrap()
    }
}

/// Host software at the other end of a link.
pub(crate) struct Host<T>(pub(crate) T);

impl<T: Read + Write + AsFd> Host<T> {
    /// Sends bytes.
    pub(crate) fn write(&mut self, bytes: &[u8]) {
        self.0.write_all(bytes).unwrap();
    }

    /// The next reply.
    pub(crate) fn read(&mut self) -> Telegram {
        let mut reply = [0; TELEGRAM];
        let mut length = 0;
        while length < TELEGRAM {
            assert!(self.has_news(PATIENCE), "{length} of {TELEGRAM} bytes");
            let count = self.0.read(&mut reply[length..]).unwrap();
            assert!(count > 0, "closed after {length} bytes");
            length += count;
        }
        reply
    }

    /// Whether anything can be read within the time.
    pub(crate) fn has_news(&self, within: Duration) -> bool {
        let timeout = Timespec { tv_sec: within.as_secs() as i64, tv_nsec: within.subsec_nanos().into() };
        rustix::event::poll(&mut [PollFd::new(&self.0, PollFlags::IN)], Some(&timeout)).unwrap() > 0
    }

    /// Sends a request and takes the reply.
    pub(crate) fn ask(&mut self, line: &str) -> Received {
        self.write(&request(line));
        binary::decode_reply(&self.read()).unwrap()
    }

    /// Sends a request that must succeed and gives the value.
    pub(crate) fn ok(&mut self, line: &str) -> i32 {
        let reply = self.ask(line);
        assert_eq!(reply.status, 100, "{line}");
        reply.value
    }

    /// Asks until the value is there.
    pub(crate) fn until(&mut self, line: &str, value: i32) {
        let end = Instant::now() + PATIENCE;
        while self.ok(line) != value {
            assert!(Instant::now() < end, "{line} is not {value}");
        }
    }
}

/// The names of the files in a folder.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
