//! The chip selects of the board and the bytes behind them.

use super::{Board, BoardKind};
use crate::chip::SpiSlave;

/// What a bus reads that nobody drives.
const FLOATING: u8 = 0xFF;

/// The chips that have a chip select.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chip {
    /// A motion controller, by its number from 0, on the motion bus.
    Tmc429(usize),
    /// The driver stage of an axis, on the motion bus.
    Tmc262(usize),
    /// The EEPROM, on a bus of its own.
    At25,
}

/// What a chip of the motion bus is sent between the fall and the rise of its chip select, whether it hears it or not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Datagram {
    /// The chip that is selected.
    pub chip: Chip,
    /// The bytes on MOSI.
    pub bytes: Vec<u8>,
}

/// A chip select and what has been said over it.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) chip: Chip,
    /// How often it fell.
    datagrams: u64,
    pub(super) selected: bool,
}

impl Line {
    /// The lines of a board, in the order of [`Board::line`].
    pub(super) fn all(kind: &BoardKind) -> Vec<Self> {
        let (controllers, axes) = (kind.controllers.len(), kind.axes());
        let chips = (0..controllers).map(Chip::Tmc429).chain((0..axes).map(Chip::Tmc262)).chain([Chip::At25]);
        chips.map(|chip| Self { chip, datagrams: 0, selected: false }).collect()
    }
}

impl Board {
    /// Chip select of `chip` falls. The owner has advanced the board to the time at which it does.
    pub fn select(&mut self, chip: Chip) {
        let Some(place) = self.line(chip) else { return };
        let line = &mut self.lines[place];
        line.selected = true;
        line.datagrams += 1;
        self.due = 0;
        if chip != Chip::At25
            && let Some(recorded) = &mut self.recorded
        {
            recorded.push(Datagram { chip, bytes: Vec::with_capacity(4) });
        }
        let now = self.now;
        if let Some(slave) = self.slave(chip) {
            slave.select(now);
        }
    }

    /// Eight clocks on the bus of `chip`, which is selected. Gives what MISO reads.
    pub fn byte(&mut self, chip: Chip, mosi: u8) -> u8 {
        // The motion bus has one datagram at a time: the last one is under way.
        if chip != Chip::At25
            && let Some(datagram) = self.recorded.as_mut().and_then(|recorded| recorded.last_mut())
            && datagram.chip == chip
        {
            datagram.bytes.push(mosi);
        }
        let Some(slave) = self.slave(chip) else { return FLOATING };
        let miso = slave.byte(mosi);
        if chip == Chip::At25 {
            self.eeprom_bytes += 1;
            if self.cut_at == Some(self.eeprom_bytes) {
                self.power_off();
                return FLOATING;
            }
            return miso;
        }
        self.motion_bus_stuck.unwrap_or(miso)
    }

    /// How many bytes the EEPROM has exchanged since the board was made.
    pub fn eeprom_bytes(&self) -> u64 {
        self.eeprom_bytes
    }

    /// The power is cut right after that many bytes in all have been exchanged with the EEPROM, whatever is
    /// going on then.
    pub fn cut_power_at_byte(&mut self, bytes: u64) {
        self.cut_at = Some(bytes);
    }

    /// Chip select of `chip` rises; its datagram takes effect.
    pub fn deselect(&mut self, chip: Chip) {
        let Some(place) = self.line(chip) else { return };
        self.lines[place].selected = false;
        let now = self.now;
        if let Some(slave) = self.slave(chip) {
            slave.deselect(now);
            if let Chip::Tmc262(axis) = chip {
                self.connect_axis(axis);
            }
            self.settle();
        }
    }

    /// How many datagrams `chip` has been sent (times its chip select fell) since the board was made.
    pub fn datagrams(&self, chip: Chip) -> u64 {
        self.line(chip).map_or(0, |place| self.lines[place].datagrams)
    }

    /// The datagrams to the chips of the motion bus since the last call, oldest first; they are recorded from the first
    /// call on.
    pub fn take_datagrams(&mut self) -> Vec<Datagram> {
        self.recorded.replace(Vec::new()).unwrap_or_default()
    }

    /// Takes the chip select of `chip` away from it, or gives it back.
    pub(super) fn set_deaf(&mut self, chip: Chip, deaf: bool) {
        let selected = self.line(chip).is_some_and(|place| self.lines[place].selected);
        let Some(was) = self.deafness(chip).map(|was| std::mem::replace(was, false)) else { return };
        let now = self.now;
        // What it hears last is that its select rises, or first that it falls.
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

    /// Whether a chip of the motion bus does not hear its chip select.
    fn deafness(&mut self, chip: Chip) -> Option<&mut bool> {
        match chip {
            Chip::Tmc429(number) => self.controllers.get_mut(number).map(|controller| &mut controller.deaf),
            Chip::Tmc262(axis) => self.drives.get_mut(axis).map(|drive| &mut drive.deaf),
            Chip::At25 => None,
        }
    }

    /// The place of a chip among the lines, if the board has it.
    #[inline]
    fn line(&self, chip: Chip) -> Option<usize> {
        let (controllers, axes) = (self.controllers.len(), self.drives.len());
        match chip {
            Chip::Tmc429(number) => (number < controllers).then_some(number),
            Chip::Tmc262(axis) => (axis < axes).then_some(controllers + axis),
            Chip::At25 => Some(controllers + axes),
        }
    }

    /// A chip at the present time, if it hears what it is told.
    #[inline]
    fn slave(&mut self, chip: Chip) -> Option<&mut dyn SpiSlave> {
        if !self.powered {
            return None;
        }
        match chip {
            Chip::Tmc429(number) => {
                let controller = self.controllers.get_mut(number).filter(|controller| !controller.deaf)?;
                controller.chip.rest(self.now);
                Some(&mut controller.chip)
            }
            Chip::Tmc262(axis) => {
                let drive = self.drives.get_mut(axis).filter(|drive| !drive.deaf)?;
                Some(&mut drive.chip)
            }
            Chip::At25 => Some(&mut self.at25),
        }
    }
}
