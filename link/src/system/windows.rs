//! Windows.

use std::fs::File;
use std::future::poll_fn;
use std::io::{self, ErrorKind, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::Poll;

use serial2::SerialPort;
use tokio::signal::windows;

use crate::number::{HANGUP, INTERRUPT, TERMINATE};

/// How a user gets a virtual module in place of a serial device that is not there.
pub(crate) const VIRTUAL_PORT: &str = "tmcl sim --tcp ADDR:PORT";

/// An end of a connection within the program.
pub type Socket = TcpStream;

/// Both ends of a connection within the program.
///
/// # Errors
/// The system has no room for it.
pub fn pair() -> io::Result<(Socket, Socket)> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    let near = TcpStream::connect(listener.local_addr()?)?;
    near.set_nodelay(true)?;
    loop {
        let (far, from) = listener.accept()?;
        // Another program that was faster finds nobody.
        if from == near.local_addr()? {
            far.set_nodelay(true)?;
            return Ok((near, far));
        }
    }
}

/// The source from which standard input is read.
pub type Input = Socket;

/// Standard input, which a thread reads from the first call on. At a console it reads whole lines.
///
/// # Errors
/// The system has no room for the thread, or for what it passes on.
pub fn standard_input() -> io::Result<Input> {
    static PASSED_ON: Mutex<Option<Input>> = Mutex::new(None);
    let mut passed_on = PASSED_ON.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(input) = passed_on.as_ref() {
        return input.try_clone();
    }
    let (input, mut sink) = pair()?;
    std::thread::Builder::new().spawn(move || {
        // What cannot be read any more has ended, and with it the connection.
        let _ = io::copy(&mut io::stdin(), &mut sink);
    })?;
    passed_on.insert(input).try_clone()
}

/// Sees to it that from now on some events no longer end the program at once. These are Ctrl-C, Ctrl-Break, and the end
/// of the console, of the session or of the system. The number of the signal that such an event stands for is put into
/// each of `numbers`, and then a byte is written into `rope`. After an end of the console the system waits some seconds
/// for the program.
pub(crate) fn watch(rope: &Socket, numbers: &[Arc<AtomicUsize>]) -> io::Result<()> {
    let (mut rope, numbers) = (rope.try_clone()?, numbers.to_vec());
    let (mut interrupt, mut stop) = (windows::ctrl_c()?, windows::ctrl_break()?);
    let (mut close, mut logoff, mut shutdown) =
        (windows::ctrl_close()?, windows::ctrl_logoff()?, windows::ctrl_shutdown()?);
    let runtime = tokio::runtime::Builder::new_current_thread().build()?;
    std::thread::Builder::new().spawn(move || {
        runtime.block_on(async {
            loop {
                let signal = poll_fn(|context| {
                    // Of several that have come at once the first here counts: after Ctrl-C alone a program may go on.
                    let events = [
                        (shutdown.poll_recv(context), TERMINATE),
                        (logoff.poll_recv(context), HANGUP),
                        (close.poll_recv(context), HANGUP),
                        (stop.poll_recv(context), TERMINATE),
                        (interrupt.poll_recv(context), INTERRUPT),
                    ];
                    let come = events.into_iter().find(|(event, _)| event.is_ready());
                    come.map_or(Poll::Pending, |(_, signal)| Poll::Ready(signal))
                });
                let signal = signal.await;
                // The number is noted before the bell rings.
                numbers.iter().for_each(|number| number.store(signal.into(), Ordering::SeqCst));
                // Whoever has left does not hear it.
                let _ = rope.write_all(&[0]);
            }
        });
    })?;
    Ok(())
}

/// Nothing limits the sizes of files here.
///
/// # Errors
/// None.
pub fn let_large_writes_fail() -> io::Result<()> {
    Ok(())
}

/// The name by which the library opens a serial device: it puts the prefix of devices, which COM10 and above need, in
/// front itself.
pub(crate) fn port_name(path: &str) -> &str {
    let prefix = [r"\\.\", "//./", r"\\?\"].into_iter().find(|prefix| path.starts_with(prefix)).unwrap_or_default();
    path.strip_prefix(prefix).unwrap_or(path)
}

/// Advice for whoever cannot open a serial device.
pub(crate) fn port_hint(_: &io::Error) -> &'static str {
    ""
}

/// True if another program has a serial device that could not be opened. The system gives a port to one program at a
/// time.
pub(crate) fn is_taken(error: &io::Error) -> bool {
    error.kind() == ErrorKind::PermissionDenied
}

/// True if what could not be opened as a serial device is none: the system has no such function for it, or has nothing
/// to say of its speed.
pub(crate) fn is_no_port(error: &io::Error) -> bool {
    const INVALID_FUNCTION: i32 = 1;
    const INVALID_HANDLE: i32 = 6;
    matches!(error.raw_os_error(), Some(INVALID_FUNCTION | INVALID_HANDLE))
}

/// Locks a serial device against other programs. The system has done that when it was opened.
pub(crate) fn lock(_: &SerialPort) -> io::Result<bool> {
    Ok(true)
}

/// Does nothing, because nothing more has to be set up.
pub(crate) fn settle(_: &SerialPort, _: &str) -> io::Result<()> {
    Ok(())
}

/// Whether a device leads to one module, which answers whatever the address. The name of a port does not tell that.
pub(crate) fn leads_to_one(_: &str) -> bool {
    false
}

/// The path of a file without links, as people write it.
///
/// # Errors
/// There is no such file, or no way to it.
pub fn real(path: &Path) -> io::Result<PathBuf> {
    let real = path.canonicalize()?;
    let shown =
        real.to_str().and_then(|real| real.strip_prefix(r"\\?\")).filter(|shown| shown.get(1..3) == Some(r":\"));
    Ok(shown.map_or(real.clone(), PathBuf::from))
}

/// True if an error of writing is that nobody reads any more.
pub fn has_no_reader(error: &io::Error) -> bool {
    const PIPE_NOT_CONNECTED: i32 = 233;
    error.kind() == ErrorKind::BrokenPipe || error.raw_os_error() == Some(PIPE_NOT_CONNECTED)
}

/// The numbers that tell a file from all others that there are at the same time.
pub type Identity = (u64, u64);

/// The identity of an open file, which tells it from others.
///
/// # Errors
/// The system does not say.
pub fn identity(file: &File) -> io::Result<Identity> {
    let information = winapi_util::file::information(file)?;
    Ok((information.volume_serial_number(), information.file_index()))
}

/// The identity of the file at a path, which tells it from others.
///
/// # Errors
/// There is no such file, or the system does not say.
pub fn identity_at(path: &Path) -> io::Result<Identity> {
    identity(&File::open(path)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_have_one_name_with_and_without_the_prefix_of_devices() {
        for name in ["COM3", "COM10", "com256"] {
            for path in [name.to_owned(), format!(r"\\.\{name}"), format!("//./{name}")] {
                assert_eq!(port_name(&path), name);
            }
        }
    }
}
