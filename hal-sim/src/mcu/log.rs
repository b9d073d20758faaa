//! The firmware's log: drained from its buffer in memory as a debug probe does (RTT), and decoded by [`Table`].

#[cfg(feature = "log")]
mod defmt;

use super::cpu::Ram;
#[cfg(feature = "log")]
use defmt::Table;

/// A message of the firmware.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLine {
    /// The firmware's own time stamp, as it shows it.
    pub timestamp: String,
    /// "error", "warn", "info", "debug", "trace"; empty where there is none.
    pub level: String,
    /// The text.
    pub text: String,
}

/// Offsets in the control block: after its name and two counts comes the first channel's description.
const CHANNEL: u32 = 24;
const BUFFER: u32 = CHANNEL + 4;
const SIZE: u32 = CHANNEL + 8;
const WRITE: u32 = CHANNEL + 12;
const READ: u32 = CHANNEL + 16;
const FLAGS: u32 = CHANNEL + 20;
/// Mode in the flags: the program is to wait while the buffer is full.
const BLOCKING: u32 = 2;
/// No buffer is longer: what says so has not been set up.
const LONGEST: u32 = 0x1_0000;
/// Ends a message.
const END: u8 = 0;

/// Without the feature `log` no image has a table of its messages, so none can be read.
#[cfg(not(feature = "log"))]
enum Table {}

#[cfg(not(feature = "log"))]
impl Table {
    fn of(_elf: &[u8]) -> Option<Self> {
        None
    }

    fn decode(&self, _bytes: &[u8]) -> Vec<LogLine> {
        match *self {}
    }
}

/// The firmware's log, as a debug probe reads it.
pub struct Log {
    memory: Ram,
    block: Option<u32>,
    table: Option<Table>,
    pending: Vec<u8>,
    /// Nobody fetches any more.
    left: bool,
}

impl Log {
    /// A reader for the image `elf`, whose control block is at `block` of `memory`.
    pub(super) fn new(elf: &[u8], block: Option<u32>, memory: Ram) -> Self {
        Self { memory, block, table: Table::of(elf), pending: Vec::new(), left: false }
    }

    /// Whether the image has a log that can be read: there is a buffer, and a table of the messages.
    pub fn is_readable(&self) -> bool {
        self.block.is_some() && self.table.is_some()
    }

    /// Fetches what is in the buffer.
    pub(super) fn drain(&mut self) {
        if let Some(block) = self.block.filter(|_| !self.left) {
            let _ = self.fetch(block);
        }
    }

    /// The debug probe is pulled off: it had asked the firmware to wait for it, and fetches no more.
    pub fn pull_probe(&mut self) {
        if let Some(block) = self.block {
            let _ = self.memory.write(block + FLAGS, &BLOCKING.to_le_bytes());
        }
        self.left = true;
    }

    fn fetch(&mut self, block: u32) -> Option<()> {
        let memory = &self.memory;
        let [buffer, size, write, mut read] =
            [BUFFER, SIZE, WRITE, READ].map(|offset| memory.word(block + offset).unwrap_or(0));
        if size == 0 || size > LONGEST || write >= size || read >= size || read == write {
            return None;
        }
        while read != write {
            let end = if write > read { write } else { size };
            let from = self.pending.len();
            self.pending.resize(from + (end - read) as usize, 0);
            memory.read(buffer + read, &mut self.pending[from..])?;
            read = end % size;
        }
        memory.write(block + READ, &read.to_le_bytes())
    }

    /// The messages that have been completed since the last call.
    pub fn take(&mut self) -> Vec<LogLine> {
        self.drain();
        let Some(end) = self.pending.iter().rposition(|&byte| byte == END) else { return Vec::new() };
        let bytes: Vec<u8> = self.pending.drain(..=end).collect();
        self.table.as_ref().map(|table| table.decode(&bytes)).unwrap_or_default()
    }
}
