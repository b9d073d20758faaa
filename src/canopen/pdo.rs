//! PDOs: their records (1400h to 1A03h), what makes one be sent, and what one that was received does.

use heapless::Vec;

use super::abort::Abort;
use super::cob;
use super::emcy::Emergency;
use super::map::{Map, PDOS, Way};
use super::object::{Entry, Object};
use super::store::Tmcm1140;
use super::{Nmt, Node};
use crate::can::{CanFrame, Frame};
use crate::device::Board;
use crate::units::Micros;

/// Transmission types from here on up to [`LAST_CYCLIC`], and 0, are synchronous, the others are event-driven.
const LAST_CYCLIC: u8 = 0xF0;

/// A PDO that the node receives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receive {
    /// The CAN identifier; `None` while the PDO is off.
    pub(super) id: Option<u16>,
    map: Map,
    /// The PDO acts at the next SYNC.
    synchronous: bool,
    /// The data that wait for a SYNC.
    waiting: Option<[u8; 8]>,
    /// The data that a SYNC has released; the next poll carries them out.
    released: Option<[u8; 8]>,
}

impl Receive {
    /// A PDO that is off.
    pub(super) const OFF: Self =
        Receive { id: None, map: Map::EMPTY, synchronous: false, waiting: None, released: None };
}

/// A PDO that the node sends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transmit {
    /// The CAN identifier; `None` while the PDO is off.
    id: Option<u16>,
    map: Map,
    /// The transmission type.
    kind: u8,
    /// The PDO is to be sent.
    due: bool,
    /// The data that were sent last; `None` if none have been sent since the PDO came into force.
    sent: Option<[u8; 8]>,
    /// When the PDO was sent last, or came into force.
    at: Micros,
    /// Number of SYNCs since the PDO was sent.
    syncs: u8,
}

impl Transmit {
    /// A PDO that is off.
    pub(super) const OFF: Self =
        Transmit { id: None, map: Map::EMPTY, kind: 0, due: false, sent: None, at: Micros(0), syncs: 0 };

    const fn is_event_driven(&self) -> bool {
        self.kind > LAST_CYCLIC
    }
}

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Brings all PDOs to their records, as after a reset.
    pub(super) fn set_up_pdos(&mut self) {
        for nth in 0..PDOS {
            self.refresh(Way::Receive, nth);
            self.refresh(Way::Transmit, nth);
        }
        self.forget_data();
    }

    /// Forgets what PDOs have carried: when PDOs begin or end, their data are old.
    pub(super) fn forget_data(&mut self) {
        for pdo in &mut self.receive {
            (pdo.waiting, pdo.released) = (None, None);
        }
        for pdo in &mut self.transmit {
            (pdo.due, pdo.sent, pdo.syncs, pdo.at) = (false, None, 0, self.now);
        }
    }

    /// Brings a PDO to its record.
    fn refresh(&mut self, way: Way, nth: u8) {
        let value = |object| self.values.get(Entry { object, nth });
        let id = |cob_id: u32| (cob_id & cob::OFF == 0).then_some(cob::can_id(cob_id));
        // A record that cannot be is never written.
        let map = Map::in_force(&self.values, way, nth).unwrap_or(Map::EMPTY);
        match way {
            Way::Receive => {
                let (id, synchronous) =
                    (id(value(Object::ReceiveCobId)), value(Object::ReceiveType) as u8 <= LAST_CYCLIC);
                if let Some(pdo) = self.receive.get_mut(usize::from(nth)) {
                    *pdo = Receive { id, map, synchronous, waiting: None, released: None };
                }
                self.filters_changed = true;
            }
            Way::Transmit => {
                let (id, kind) = (id(value(Object::TransmitCobId)), value(Object::TransmitType) as u8);
                if let Some(pdo) = self.transmit.get_mut(usize::from(nth)) {
                    *pdo = Transmit { id, map, kind, at: self.now, ..Transmit::OFF };
                }
            }
        }
    }

    /// Writes the COB-ID of a PDO. Bit 30 may be written either way and reads 1.
    pub(super) fn write_cob_id(&mut self, way: Way, entry: Entry, cob_id: u32) -> Result<(), Abort> {
        cob::pdo(cob_id)?;
        let old = self.values.get(entry);
        let stays_valid = (old | cob_id) & cob::OFF == 0;
        if stays_valid && cob::can_id(old) != cob::can_id(cob_id) && !self.manufacturer_mode {
            return Err(Abort::Access);
        }
        self.set_record(way, entry, cob_id | cob::BIT_30);
        Ok(())
    }

    /// Writes the number of objects that a PDO carries.
    pub(super) fn write_mapped(&mut self, way: Way, entry: Entry, count: u32) -> Result<(), Abort> {
        if self.is_valid(way, entry.nth) && !self.manufacturer_mode {
            return Err(Abort::Access);
        }
        Map::of(&self.values, way, entry.nth, count)?;
        self.set_record(way, entry, count);
        Ok(())
    }

    /// Writes a mapping entry; 0 maps nothing.
    pub(super) fn write_mapping(&mut self, way: Way, entry: Entry, value: u32) -> Result<(), Abort> {
        let in_use = self.is_valid(way, entry.nth) || !Map::in_force(&self.values, way, entry.nth)?.is_empty();
        if in_use && !self.manufacturer_mode {
            return Err(Abort::Access);
        }
        if value != 0 {
            way.mappable(value)?;
        }
        let old = self.values.get(entry);
        self.values.set(entry, value);
        if let Err(abort) = Map::in_force(&self.values, way, entry.nth) {
            self.values.set(entry, old);
            return Err(abort);
        }
        self.refresh(way, entry.nth);
        Ok(())
    }

    /// Writes a value of a PDO's record that is known to be right.
    pub(super) fn set_record(&mut self, way: Way, entry: Entry, value: u32) {
        if self.values.get(entry) != value {
            self.values.set(entry, value);
            self.refresh(way, entry.nth);
        }
    }

    fn is_valid(&self, way: Way, nth: u8) -> bool {
        let nth = usize::from(nth);
        match way {
            Way::Receive => self.receive.get(nth).is_some_and(|pdo| pdo.id.is_some()),
            Way::Transmit => self.transmit.get(nth).is_some_and(|pdo| pdo.id.is_some()),
        }
    }

    /// Takes a frame with this identifier, if it is a PDO that is received.
    pub(super) fn receive_pdo(&mut self, id: u16, frame: &Frame) {
        if self.state != Nmt::Operational {
            return;
        }
        let Some(pdo) = self.receive.iter_mut().find(|pdo| pdo.id == Some(id) && !pdo.map.is_empty()) else { return };
        let length = usize::from(pdo.map.length);
        if frame.dlc() < length {
            self.raise(Emergency::PdoTooShort);
        } else if frame.dlc() > length {
            self.raise(Emergency::PdoTooLong);
        } else if pdo.synchronous {
            pdo.waiting = Some(frame.bytes());
        } else {
            let map = pdo.map;
            self.carry_out(&[(map, frame.bytes())]);
        }
    }

    /// Writes the objects of PDOs that were received together, in their order, but the controlword last: it acts upon the
    /// others. Each value is refused for itself.
    fn carry_out(&mut self, pdos: &[(Map, [u8; 8])]) {
        if self.tunnel.in_tmcl_mode() {
            return self.raise(Emergency::Refused);
        }
        let mut refused = false;
        for last in [false, true] {
            for (map, bytes) in pdos {
                let mut rest = u64::from_le_bytes(*bytes);
                for (entry, size) in map.iter() {
                    let number = entry.row().data.extend(rest as u32);
                    rest = rest.unbounded_shr((size as u32).saturating_mul(8));
                    if (entry.object == Object::Controlword) == last {
                        refused |= self.write(entry, number).is_err();
                    }
                }
            }
        }
        if refused {
            self.raise(Emergency::Refused);
        }
    }

    /// The SYNC: PDOs that were received act in the next poll, and those that are to be sent go out.
    pub(super) fn synchronise(&mut self) {
        if self.state != Nmt::Operational {
            return;
        }
        for pdo in &mut self.receive {
            if pdo.waiting.is_some() {
                pdo.released = pdo.waiting.take();
            }
        }
        for nth in 0..usize::from(PDOS) {
            let Some(pdo) = self.transmit.get_mut(nth) else { continue };
            match pdo.kind {
                0 => {
                    let (map, sent) = (pdo.map, pdo.sent);
                    let changed = sent != Some(self.data(map));
                    if let Some(pdo) = self.transmit.get_mut(nth) {
                        pdo.due |= changed;
                    }
                }
                1..=LAST_CYCLIC => {
                    pdo.syncs = pdo.syncs.saturating_add(1);
                    pdo.due |= pdo.syncs >= pdo.kind;
                }
                _ => {}
            }
        }
    }

    /// True while PDOs that a SYNC has released have not acted.
    pub(super) fn has_released(&self) -> bool {
        self.receive.iter().any(|pdo| pdo.released.is_some())
    }

    /// Carries out the PDOs that a SYNC has released. A master may send the controlword in each of them, as their defaults
    /// have it: with all other objects written before, it finds the new ones in any case.
    pub(super) fn act(&mut self) {
        let mut pdos = Vec::<_, { PDOS as usize }>::new();
        for pdo in &mut self.receive {
            if let Some(bytes) = pdo.released.take() {
                // There is room for all of them.
                let _ = pdos.push((pdo.map, bytes));
            }
        }
        if !pdos.is_empty() {
            self.carry_out(&pdos);
        }
    }

    /// The data of a PDO that is to be sent.
    fn data(&self, map: Map) -> [u8; 8] {
        let (mut data, mut shift) = (0_u64, 0_u32);
        for (entry, size) in map.iter() {
            let bits = (size as u32).saturating_mul(8);
            let number = u64::from(self.number(entry)) & !u64::MAX.unbounded_shl(bits);
            data |= number.unbounded_shl(shift);
            shift = shift.saturating_add(bits);
        }
        data.to_le_bytes()
    }

    /// Finds the event-driven PDOs that are to be sent, because what they carry has changed. Called after each frame
    /// and each turn.
    pub(super) fn look_for_events(&mut self) {
        if self.state != Nmt::Operational {
            return;
        }
        self.touched = false;
        for nth in 0..PDOS {
            let place = usize::from(nth);
            let Some(pdo) = self.transmit.get(place) else { continue };
            let changed = pdo.is_event_driven() && pdo.id.is_some() && !pdo.due && pdo.sent != Some(self.data(pdo.map));
            if changed {
                let inhibited = self.is_inhibited(nth);
                // A PDO that is inhibited is looked at again in each turn.
                self.touched |= inhibited;
                if let Some(pdo) = self.transmit.get_mut(place) {
                    pdo.due = !inhibited;
                }
            }
        }
    }

    /// Finds the event-driven PDOs that are to be sent, because their event timer is over. Called after each turn.
    pub(super) fn look_at_timers(&mut self) {
        for nth in 0..PDOS {
            if !self.transmit.get(usize::from(nth)).is_some_and(Transmit::is_event_driven) {
                continue;
            }
            let timer = self.milliseconds(Entry { object: Object::TransmitEventTimer, nth });
            let inhibited = self.is_inhibited(nth);
            let now = self.now;
            if let Some(pdo) = self.transmit.get_mut(usize::from(nth))
                && timer > Micros(0)
            {
                pdo.due |= now.since(pdo.at) >= timer && !inhibited;
            }
        }
    }

    /// True while a PDO may not be sent again, so soon after the last time.
    fn is_inhibited(&self, nth: u8) -> bool {
        let time = self.milliseconds(Entry { object: Object::TransmitInhibitTime, nth });
        let pdo = self.transmit.get(usize::from(nth));
        pdo.is_some_and(|pdo| pdo.sent.is_some() && self.now.since(pdo.at) < time)
    }

    /// The value of an object in milliseconds.
    pub(super) fn milliseconds(&self, entry: Entry) -> Micros {
        Micros::from_millis(self.values.get(entry).into())
    }

    /// The next PDO to be sent, with the data as they are now.
    pub(super) fn next_pdo(&mut self) -> Option<Frame> {
        if self.state != Nmt::Operational {
            return None;
        }
        for nth in 0..usize::from(PDOS) {
            let Some(Transmit { id, map, due: true, .. }) = self.transmit.get(nth) else { continue };
            let (id, map) = (*id, *map);
            let data = self.data(map);
            if let Some(pdo) = self.transmit.get_mut(nth) {
                (pdo.due, pdo.sent, pdo.at, pdo.syncs) = (false, Some(data), self.now, 0);
            }
            if let Some(id) = id.filter(|_| !map.is_empty()) {
                return Frame::standard(id, data.get(..map.length.into())?);
            }
        }
        None
    }
}
