//! The messages of an image as defmt writes them.

use defmt_decoder::DecodeError;

use super::LogLine;

/// The table of an image's messages.
pub(super) struct Table(defmt_decoder::Table);

impl Table {
    /// The table of the image `elf`; `None` if it has none, as one that was built without a log.
    pub(super) fn of(elf: &[u8]) -> Option<Self> {
        defmt_decoder::Table::parse(elf).ok().flatten().map(Self)
    }

    /// The messages in bytes that end with a whole one.
    pub(super) fn decode(&self, bytes: &[u8]) -> Vec<LogLine> {
        let mut decoder = self.0.new_stream_decoder();
        decoder.received(bytes);
        let mut lines = Vec::new();
        loop {
            match decoder.decode() {
                Ok(frame) => lines.push(LogLine {
                    timestamp: frame.display_timestamp().map(|stamp| stamp.to_string()).unwrap_or_default(),
                    level: frame.level().map(|level| level.as_str().to_owned()).unwrap_or_default(),
                    text: frame.display_message().to_string(),
                }),
                Err(DecodeError::UnexpectedEof) => return lines,
                Err(DecodeError::Malformed) => {}
            }
        }
    }
}
