//! SLCAN: CAN frames as lines of text (LAWICEL CAN232 and CANUSB manuals), and an adapter that exchanges such lines
//! with a host.

use tmcm::can::{CanFrame, ExtendedId, Frame, Id, StandardId};

/// End of a line; alone, the answer to a command that was carried out.
pub const DONE: u8 = b'\r';
/// Answer to a command that was refused.
pub const REFUSED: u8 = 7;
/// Longest line in characters: an extended frame of eight bytes.
const LONGEST: usize = 26;
/// Period of time stamps in milliseconds: they count from 0 to 59 999.
const MINUTE: u64 = 60_000;

/// The frame of a line `t`, `T`, `r` or `R` with identifier, length and data; `None` for any other line.
pub fn parse(line: &str) -> Option<Frame> {
    let (extended, remote) = match line.chars().next()? {
        't' => (false, false),
        'T' => (true, false),
        'r' => (false, true),
        'R' => (true, true),
        _ => return None,
    };
    let digits = if extended { 8 } else { 3 };
    let number = hex(line.get(1..1 + digits)?)?;
    let id: Id =
        if extended { ExtendedId::new(number)?.into() } else { StandardId::new(u16::try_from(number).ok()?)?.into() };
    let length = hex(line.get(1 + digits..2 + digits)?).filter(|length| *length <= 8)? as usize;
    let rest = line.get(2 + digits..)?;
    if remote {
        return rest.is_empty().then(|| Frame::new_remote(id, length))?;
    }
    (rest.len() == 2 * length).then_some(())?;
    let bytes = (0..rest.len()).step_by(2).map(|at| Some(hex(rest.get(at..at + 2)?)? as u8));
    Frame::new(id, &bytes.collect::<Option<Vec<u8>>>()?)
}

/// The line of a frame, without the CR at its end.
pub fn line(frame: &Frame) -> String {
    let kind = if frame.is_remote_frame() { 'r' } else { 't' };
    let id = match frame.id() {
        Id::Standard(id) => format!("{kind}{:03X}", id.as_raw()),
        Id::Extended(id) => format!("{}{:08X}", kind.to_ascii_uppercase(), id.as_raw()),
    };
    let data: String = frame.data().iter().map(|byte| format!("{byte:02X}")).collect();
    format!("{id}{}{data}", frame.dlc())
}

fn hex(digits: &str) -> Option<u32> {
    let all = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    u32::from_str_radix(digits, 16).ok().filter(|_| all)
}

/// State of the adapter's channel to the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Channel {
    #[default]
    Closed,
    Open,
    /// Open for receiving only.
    Listening,
}

/// An SLCAN adapter: takes lines of a host, gives answers and frames of the bus. The bit rate that the host sets has no
/// effect. Opening an open channel and closing a closed one succeed.
#[derive(Clone, Debug, Default)]
pub struct Adapter {
    channel: Channel,
    stamps: bool,
    line: Vec<u8>,
    /// Bytes for the host.
    out: Vec<u8>,
}

impl Adapter {
    /// Takes a byte from the host. Returns a frame for the bus if the byte completes its line.
    pub fn push(&mut self, byte: u8) -> Option<Frame> {
        if byte != DONE {
            // Line feeds are ignored. A line that is too long is cut, and then refused because of its length.
            if byte != b'\n' && self.line.len() <= LONGEST {
                self.line.push(byte);
            }
            return None;
        }
        let line = std::mem::take(&mut self.line);
        let line = std::str::from_utf8(&line).unwrap_or("?");
        let frame = parse(line).filter(|_| self.channel == Channel::Open);
        let (answer, end) = match &frame {
            Some(frame) => (if frame.is_extended() { "Z" } else { "z" }, DONE),
            None => self.command(line).map_or(("", REFUSED), |answer| (answer, DONE)),
        };
        self.out.extend_from_slice(answer.as_bytes());
        self.out.push(end);
        frame
    }

    /// Writes a frame of the bus for the host, with a time stamp if wanted; `millis` is the time in milliseconds.
    pub fn hear(&mut self, frame: &Frame, millis: u64) {
        if self.channel == Channel::Closed {
            return;
        }
        self.out.extend_from_slice(line(frame).as_bytes());
        if self.stamps {
            self.out.extend_from_slice(format!("{:04X}", millis % MINUTE).as_bytes());
        }
        self.out.push(DONE);
    }

    /// The bytes for the host since the last call.
    pub fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.out)
    }

    /// Carries out a command to the adapter itself and returns the answer; `None` if the command is refused.
    fn command(&mut self, line: &str) -> Option<&'static str> {
        let open = self.channel != Channel::Closed;
        let mut letters = line.chars();
        match (letters.next(), letters.as_str()) {
            (None, _) => {}
            (Some('C'), "") => self.channel = Channel::Closed,
            (Some('O'), "") => self.channel = Channel::Open,
            (Some('L'), "") => self.channel = Channel::Listening,
            (Some('S'), "0" | "1" | "2" | "3" | "4" | "5" | "6" | "7" | "8") if !open => {}
            (Some('s'), registers) if !open && registers.len() == 4 => hex(registers).map(|_| ())?,
            (Some('Z'), "0" | "1") if !open => self.stamps = line == "Z1",
            // No error flag is set, because the virtual bus has no errors.
            (Some('F'), "") if open => return Some("F00"),
            (Some('V'), "") => return Some("V0101"),
            (Some('v'), "") => return Some("v0101"),
            (Some('N'), "") => return Some("NTMCL"),
            _ => return None,
        }
        Some("")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn say(adapter: &mut Adapter, text: &str) -> (Vec<Frame>, String) {
        let frames = text.bytes().filter_map(|byte| adapter.push(byte)).collect();
        (frames, String::from_utf8(adapter.take()).unwrap())
    }

    #[test]
    fn frames_are_read_and_written() {
        for line in ["t0018060401000000AA00", "t7FF0", "T1FFFFFFF3010203", "r1238", "R000000020"] {
            assert_eq!(parse(line).map(|frame| super::line(&frame)).as_deref(), Some(line));
        }
        for line in
            ["", "t", "t001", "t8000", "t0019", "t001200", "t00110", "t001101x", "t+011", "r00110", "x0010", "tä"]
        {
            assert_eq!(parse(line), None, "{line}");
        }
    }

    #[test]
    fn a_channel_may_be_opened_or_closed_twice() {
        let mut adapter = Adapter::default();
        assert_eq!(say(&mut adapter, "t0010\r"), (vec![], "\x07".into()));
        assert_eq!(say(&mut adapter, "\r\rC\rC\rS8\r\rO\rO\r").1, "\r".repeat(8));
        let (frames, answer) = say(&mut adapter, "t0010\rT000000020\r");
        assert_eq!((frames.len(), answer.as_str()), (2, "z\rZ\r"));
        assert_eq!(say(&mut adapter, "S8\rZ1\rF\rV\rv\rN\rX\r").1, "\x07\x07F00\rV0101\rv0101\rNTMCL\r\x07");
        let frame = parse("t0021AB").unwrap();
        adapter.hear(&frame, 60_018);
        assert_eq!(adapter.take(), b"t0021AB\r");
        assert_eq!(say(&mut adapter, "C\rs031C\rZ1\rL\rt0010\r"), (vec![], "\r\r\r\r\x07".into()));
        adapter.hear(&frame, 60_018);
        assert_eq!(adapter.take(), b"t0021AB0012\r");
        assert_eq!(say(&mut adapter, "C\r").1, "\r");
        adapter.hear(&frame, 0);
        assert_eq!(adapter.take(), b"");
    }

    #[test]
    fn an_unknown_command_is_refused_and_the_next_one_works() {
        let mut adapter = Adapter::default();
        assert_eq!(say(&mut adapter, &("t0018".to_owned() + &"0".repeat(100) + "\rO\r")).1, "\x07\r");
        adapter.push(0xFF);
        assert_eq!(say(&mut adapter, "\rS9\rS\rQ1\r").1, "\x07\x07\x07\x07");
    }
}
