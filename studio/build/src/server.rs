//! The connections of browsers.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use crate::answer::Answer;
use crate::files::Files;
use crate::request::LIMIT;

/// How many connections are served at once. More of them wait for these to end.
const CONNECTIONS: usize = 64;
/// How long a request may take to come, and how long a piece of the answer may take to be fetched.
const PATIENCE: Duration = Duration::from_secs(10);
/// The most that is read of what follows a request, in bytes and in time.
const REST: (u64, Duration) = (1 << 20, Duration::from_secs(2));

/// A server of files, for the programs of this computer alone.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    port: u16,
    files: Files,
}

impl Server {
    /// A server at a port, or at any free one if that is 0. The error is one sentence.
    pub fn bind(files: Files, port: u16) -> Result<Self, String> {
        let failed = |error| format!("nothing can be served at port {port}: {error}; choose another by --port");
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(failed)?;
        let port = listener.local_addr().map_err(failed)?.port();
        Ok(Self { listener, port, files })
    }

    /// The port at which it is.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Serves until the process ends.
    pub fn run(&self) -> ! {
        thread::scope(|scope| {
            for _ in 1..CONNECTIONS {
                // Where a computer has no more threads, fewer connections are served at once.
                if thread::Builder::new().spawn_scoped(scope, || self.serve()).is_err() {
                    break;
                }
            }
            self.serve()
        })
    }

    /// Serves one connection after the other.
    fn serve(&self) -> ! {
        loop {
            match self.listener.accept() {
                // A connection that fails is the browser's loss, who asks again.
                Ok((stream, _)) => _ = self.answer(&stream),
                // As where no more files can be open, which passes.
                Err(_) => thread::sleep(Duration::from_millis(100)),
            }
        }
    }

    fn answer(&self, mut stream: &TcpStream) -> io::Result<()> {
        let request = request(Patient { stream, end: Instant::now() + PATIENCE });
        // Browsers open connections that they may need later.
        if request.is_empty() {
            return Ok(());
        }
        let answer = Answer::to(&request, &self.files, self.port);
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(PATIENCE))?;
        stream.write_all(answer.head().as_bytes())?;
        stream.write_all(answer.body())?;
        stream.shutdown(Shutdown::Write)?;
        // A connection that is closed before all is read takes the answer with it.
        let (length, time) = REST;
        io::copy(&mut Patient { stream, end: Instant::now() + time }.take(length), &mut io::sink())?;
        Ok(())
    }
}

/// The bytes of a request to the empty line that ends it; fewer if no more come, and one more than may be if there are
/// too many.
fn request(from: impl Read) -> Vec<u8> {
    let mut from = BufReader::new(from.take(LIMIT as u64 + 1));
    let mut request = Vec::new();
    while !request.ends_with(b"\r\n\r\n") && from.read_until(b'\n', &mut request).is_ok_and(|length| length > 0) {}
    request
}

/// A connection that is read until a time, whenever its bytes come.
struct Patient<'a> {
    stream: &'a TcpStream,
    end: Instant,
}

impl Read for Patient<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // No time at all is refused here.
        self.stream.set_read_timeout(Some(self.end.saturating_duration_since(Instant::now())))?;
        self.stream.read(buffer)
    }
}
