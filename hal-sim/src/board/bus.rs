//! The chip selects of the board, and the bytes that go over its SPI buses.

use super::Board;
use super::kind::{BoardKind, Chip};
use super::motion::Motion;
use crate::chip::SpiSlave;
use crate::chip::tmc5160::Tmc5160;
use crate::clock::Nanos;

/// The byte that a bus reads if no chip drives it.
const FLOATING: u8 = 0xFF;

/// The bytes that are sent to a chip of the motion bus between the fall and the rise of its chip select. The chip need
/// not hear them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Datagram {
    /// The chip that is selected.
    pub chip: Chip,
    /// The bytes on MOSI.
    pub bytes: Vec<u8>,
}

/// A chip select, and what has been sent while it was low.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) chip: Chip,
    /// Number of times that the chip select fell.
    pub(super) datagrams: u64,
    pub(super) selected: bool,
    /// When the chip select rose last.
    deselected: Nanos,
}

/// Datagrams on the motion bus whose answers are lost: it reads all ones.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Loss {
    /// Number of datagrams that come before them.
    after: u64,
    /// Number of those that are still to come.
    count: u64,
    /// The datagrams themselves are lost as well.
    whole: bool,
    /// The datagram under way is one of them.
    now: bool,
}

impl Loss {
    /// Some are still to come.
    pub(super) fn is_due(&self) -> bool {
        self.count > 0
    }

    /// A datagram begins.
    fn begin(&mut self) {
        self.now = self.after == 0 && self.count > 0;
        if self.now {
            self.count -= 1;
        }
        self.after = self.after.saturating_sub(1);
    }
}

impl Line {
    /// The lines of a board.
    pub(super) fn all(kind: &BoardKind) -> Vec<Self> {
        let chips = kind.motion_bus().chain([Chip::At25]);
        chips.map(|chip| Self { chip, datagrams: 0, selected: false, deselected: 0 }).collect()
    }
}

impl Board {
    /// The chip select of `chip` falls. The caller has advanced the board to the time of this.
    pub fn select(&mut self, chip: Chip) {
        let Some(index) = self.line(chip) else { return };
        let line = &mut self.lines[index];
        line.selected = true;
        line.datagrams += 1;
        if chip != Chip::At25 {
            self.loss.begin();
        }
        if chip != Chip::At25
            && let Some(recorded) = &mut self.recorded
        {
            recorded.push(Datagram { chip, bytes: Vec::with_capacity(4) });
        }
        let now = self.now;
        if let Some(slave) = self.slave(chip) {
            slave.select(now);
            // A TMC429 in power-down wakes up, and its steps may be due before all that was.
            self.due = self.due.min(self.motion.chips().next_due());
        }
    }

    /// Eight clocks on the bus of `chip`, which is selected. Returns the byte that MISO reads.
    pub fn byte(&mut self, chip: Chip, mosi: u8) -> u8 {
        let mut byte = [mosi];
        self.exchange(chip, &mut byte);
        let [miso] = byte;
        miso
    }

    /// Clocks `bytes` over the bus of `chip`, which is selected, all at the present time, and puts those that MISO
    /// reads in their places.
    pub(super) fn exchange(&mut self, chip: Chip, bytes: &mut [u8]) {
        if chip == Chip::At25 {
            return bytes.iter_mut().for_each(|byte| *byte = self.eeprom_byte(*byte));
        }
        // The motion bus carries one datagram at a time, so the last one is under way.
        if let Some(datagram) = self.recorded.as_mut().and_then(|recorded| recorded.last_mut())
            && datagram.chip == chip
        {
            datagram.bytes.extend_from_slice(bytes);
        }
        match self.slave(chip) {
            Some(slave) => slave.bytes(bytes),
            None => return bytes.fill(FLOATING),
        }
        if self.loss.now {
            bytes.fill(FLOATING);
        } else if let Some(stuck) = self.motion_bus_stuck {
            bytes.fill(stuck);
        }
    }

    /// Eight clocks on the bus of the EEPROM, after which the power may be cut.
    fn eeprom_byte(&mut self, mosi: u8) -> u8 {
        let Some(slave) = self.slave(Chip::At25) else { return FLOATING };
        let miso = slave.byte(mosi);
        self.eeprom_bytes += 1;
        if self.cut_at == Some(self.eeprom_bytes) {
            self.power_off();
            return FLOATING;
        }
        miso
    }

    /// Loses the answers of `count` datagrams on the motion bus, after `after` others; where `whole` is true, the
    /// datagrams as well, so that their chips hear nothing of them.
    pub fn lose_answers(&mut self, after: u64, count: u64, whole: bool) {
        self.loss = Loss { after, count, whole, now: false };
    }

    /// Number of bytes that have been exchanged with the EEPROM since the board was made.
    pub fn eeprom_bytes(&self) -> u64 {
        self.eeprom_bytes
    }

    /// Cuts the power as soon as `bytes` bytes in all have been exchanged with the EEPROM, whatever is going on then.
    pub fn cut_power_at_byte(&mut self, bytes: u64) {
        self.cut_at = Some(bytes);
    }

    /// The chip select of `chip` rises, and the datagram takes effect.
    pub fn deselect(&mut self, chip: Chip) {
        let Some(index) = self.line(chip) else { return };
        let now = self.now;
        (self.lines[index].selected, self.lines[index].deselected) = (false, now);
        if let Some(slave) = self.slave(chip) {
            slave.deselect(now);
            if let Chip::Tmc429(_) = chip {
                // What a datagram to a TMC429 leads to comes later, and what is due otherwise stays so.
                self.due = self.due.min(self.motion.chips().next_due());
                return;
            }
            // A datagram to a driver acts on its motor at once.
            if let Chip::Tmc262(axis) | Chip::Tmc5160(axis) = chip {
                self.connect_axis(axis);
                self.settle();
            }
            self.due = self.next_due();
        }
    }

    /// The first time at which `chip` understands another select after its last datagram. Chips that demand nothing of
    /// the kind take it at any time.
    pub(super) fn ready(&self, chip: Chip) -> Nanos {
        let (Motion::Tmc5160s(chips), Chip::Tmc5160(axis)) = (&self.motion, chip) else { return 0 };
        let high = chips.tmc5160(axis).map_or(0, Tmc5160::select_high);
        self.line(chip).map_or(0, |index| self.lines[index].deselected + high)
    }

    /// Number of datagrams to `chip`, that is, of times that its chip select fell, since the board was made.
    pub fn datagrams(&self, chip: Chip) -> u64 {
        self.line(chip).map_or(0, |index| self.lines[index].datagrams)
    }

    /// The datagrams to the chips of the motion bus since the last call, oldest first. They are recorded from the first
    /// call on.
    pub fn take_datagrams(&mut self) -> Vec<Datagram> {
        self.recorded.replace(Vec::new()).unwrap_or_default()
    }

    /// Disconnects a chip from its chip select, or connects it again.
    pub(super) fn set_deaf(&mut self, chip: Chip, deaf: bool) {
        let selected = self.line(chip).is_some_and(|index| self.lines[index].selected);
        let Some(was) = self.deafness(chip).map(|was| std::mem::replace(was, false)) else { return };
        let now = self.now;
        // A chip that is disconnected while selected sees its select rise; one that is connected then sees it fall.
        if selected
            && was != deaf
            && let Some(slave) = self.slave(chip)
        {
            if deaf { slave.deselect(now) } else { slave.select(now) }
        }
        if let Some(is) = self.deafness(chip) {
            *is = deaf;
        }
    }

    /// The fault "does not hear its chip select" of a chip of the motion bus.
    fn deafness(&mut self, chip: Chip) -> Option<&mut bool> {
        self.motion.chips_mut().deafness(chip)
    }

    /// The index of a chip among the lines; `None` if the board does not have the chip.
    #[inline]
    fn line(&self, chip: Chip) -> Option<usize> {
        self.lines.iter().position(|line| line.chip == chip)
    }

    /// A chip, brought to the present time; `None` if it has no power or does not hear its chip select.
    #[inline]
    fn slave(&mut self, chip: Chip) -> Option<&mut dyn SpiSlave> {
        match chip {
            _ if !self.powered => None,
            Chip::At25 => Some(&mut self.at25),
            _ if self.loss.now && self.loss.whole => None,
            chip => self.motion.slave(chip, self.now),
        }
    }
}
