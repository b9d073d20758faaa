//! PDOs: their records (1400h to 1A03h), what makes one be sent, and what one that was received carries.

use heapless::Vec;

use super::map::Map;
use super::record::{Direction, Field, Record};
use crate::can::{CanFrame, Frame};
use crate::units::Micros;

/// Number of PDOs in each direction.
pub(crate) const PDOS: u8 = 4;

/// Transmission types from here on up to [`LAST_CYCLIC`], and 0, are synchronous, the others are event-driven.
const LAST_CYCLIC: u8 = 0xF0;

/// A PDO that the node receives.
#[derive(Clone, Copy, Debug)]
struct Receive<E> {
    /// The CAN identifier; `None` while the PDO is off.
    id: Option<u16>,
    map: Map<E>,
    /// The PDO acts at the next SYNC.
    synchronous: bool,
    /// The data that wait for a SYNC.
    waiting: Option<[u8; 8]>,
    /// The data that a SYNC has released; the next poll carries them out.
    released: Option<[u8; 8]>,
}

/// A PDO that the node sends.
#[derive(Clone, Copy, Debug)]
struct Transmit<E> {
    /// The CAN identifier; `None` while the PDO is off.
    id: Option<u16>,
    map: Map<E>,
    /// The transmission type.
    kind: u8,
    inhibit: Micros,
    timer: Micros,
    /// The PDO is to be sent.
    due: bool,
    /// The data that were sent last; `None` if none have been sent since the PDO came into force.
    sent: Option<[u8; 8]>,
    /// When the PDO was sent last, or came into force.
    at: Micros,
    /// Number of SYNCs since the PDO was sent.
    syncs: u8,
}

impl<E: Copy> Transmit<E> {
    const fn is_event_driven(&self) -> bool {
        self.kind > LAST_CYCLIC
    }

    /// True while the PDO may not be sent again, so soon after the last time.
    fn is_inhibited(&self, now: Micros) -> bool {
        self.sent.is_some() && now.since(self.at) < self.inhibit
    }
}

/// A frame that was looked at as a PDO.
#[derive(Debug)]
pub(crate) enum Received<E> {
    /// The frame is no PDO of this node, or waits for the SYNC.
    Nothing,
    /// The frame has fewer bytes than the objects that it is to carry.
    TooShort,
    /// The frame has more bytes than these.
    TooLong,
    /// The frame carries these objects, which are to be written at once.
    Carried(Carried<E>),
}

/// The objects that a PDO carries, with its data.
pub(crate) type Carried<E> = (Map<E>, [u8; 8]);

/// The PDOs of a node.
#[derive(Debug)]
pub(crate) struct Pdos<E> {
    receive: [Receive<E>; PDOS as usize],
    transmit: [Transmit<E>; PDOS as usize],
    /// Something has been written or read that an event-driven PDO may carry.
    pub(crate) touched: bool,
}

impl<E: Copy> Pdos<E> {
    /// All PDOs are off.
    pub(super) const fn new() -> Self {
        let (map, at) = (Map::EMPTY, Micros(0));
        let receive = Receive { id: None, map, synchronous: false, waiting: None, released: None };
        let transmit =
            Transmit { id: None, map, kind: 0, inhibit: at, timer: at, due: false, sent: None, at, syncs: 0 };
        let (receive, transmit) = ([receive; _], [transmit; _]);
        Pdos { receive, transmit, touched: false }
    }

    /// Brings a PDO to its record, as after a reset. True if the node listens to another identifier then.
    pub(crate) fn set_up(
        &mut self,
        now: Micros,
        (direction, nth): (Direction, u8),
        record: &Record,
        map: Map<E>,
    ) -> bool {
        let (id, kind, nth) = (record.id(), record.kind, usize::from(nth));
        let mut readdressed = false;
        match direction {
            Direction::Receive => {
                if let Some(pdo) = self.receive.get_mut(nth) {
                    readdressed = pdo.id != id;
                    *pdo = Receive { id, map, synchronous: kind <= LAST_CYCLIC, waiting: None, released: None };
                }
            }
            Direction::Transmit => {
                if let Some(pdo) = self.transmit.get_mut(nth) {
                    let Record { inhibit, timer, .. } = *record;
                    *pdo = Transmit { id, map, kind, inhibit, timer, due: false, sent: None, at: now, syncs: 0 };
                }
            }
        }
        readdressed
    }

    /// Brings a PDO to the record that a master has written a field of. True as for [`Pdos::set_up`].
    pub(crate) fn change(
        &mut self,
        now: Micros,
        place: (Direction, u8),
        field: Field,
        record: &Record,
        map: Map<E>,
    ) -> bool {
        if field != Field::Time {
            return self.set_up(now, place, record, map);
        }
        if let Some(pdo) = self.transmit.get_mut(usize::from(place.1)) {
            (pdo.inhibit, pdo.timer) = (record.inhibit, record.timer);
        }
        false
    }

    /// Forgets what PDOs have carried: when PDOs begin or end, their data are old.
    pub(super) fn forget_data(&mut self, now: Micros) {
        for pdo in &mut self.receive {
            (pdo.waiting, pdo.released) = (None, None);
        }
        for pdo in &mut self.transmit {
            (pdo.due, pdo.sent, pdo.syncs, pdo.at) = (false, None, 0, now);
        }
        self.touched = true;
    }

    /// The CAN identifiers of the PDOs that are received.
    pub(crate) fn identifiers(&self) -> impl Iterator<Item = u16> {
        self.receive.iter().filter_map(|pdo| pdo.id)
    }

    /// Takes a frame with this identifier.
    pub(crate) fn receive(&mut self, id: u16, frame: &Frame) -> Received<E> {
        let wanted = |pdo: &&mut Receive<E>| pdo.id == Some(id) && !pdo.map.is_empty();
        let Some(pdo) = self.receive.iter_mut().find(wanted) else { return Received::Nothing };
        let length = usize::from(pdo.map.length);
        if frame.dlc() < length {
            Received::TooShort
        } else if frame.dlc() > length {
            Received::TooLong
        } else if pdo.synchronous {
            pdo.waiting = Some(frame.bytes());
            Received::Nothing
        } else {
            Received::Carried((pdo.map, frame.bytes()))
        }
    }

    /// The SYNC: PDOs that were received are released, and those that are to be sent become due. `read` reads an
    /// object.
    pub(crate) fn synchronise(&mut self, read: impl Fn(E) -> u32) {
        for pdo in &mut self.receive {
            if pdo.waiting.is_some() {
                pdo.released = pdo.waiting.take();
            }
        }
        for pdo in &mut self.transmit {
            match pdo.kind {
                0 => pdo.due |= pdo.sent != Some(pdo.map.packed(&read)),
                1..=LAST_CYCLIC => {
                    pdo.syncs = pdo.syncs.saturating_add(1);
                    pdo.due |= pdo.syncs >= pdo.kind;
                }
                _ => {}
            }
        }
    }

    /// True while PDOs that a SYNC has released have not been taken.
    pub(crate) fn has_released(&self) -> bool {
        self.receive.iter().any(|pdo| pdo.released.is_some())
    }

    /// Takes the PDOs that a SYNC has released. A master may send the controlword in each of them, as their defaults
    /// have it: with all other objects written before, it finds the new ones in any case.
    pub(crate) fn take_released(&mut self) -> Vec<Carried<E>, { PDOS as usize }> {
        let mut pdos = Vec::new();
        for pdo in &mut self.receive {
            if let Some(data) = pdo.released.take() {
                // There is room for all of them.
                let _ = pdos.push((pdo.map, data));
            }
        }
        pdos
    }

    /// Finds the event-driven PDOs that are to be sent, because what they carry has changed. To be called after each
    /// frame and each turn.
    pub(crate) fn look_for_events(&mut self, now: Micros, read: impl Fn(E) -> u32) {
        self.touched = false;
        for pdo in &mut self.transmit {
            let changes = pdo.is_event_driven() && pdo.id.is_some() && !pdo.due;
            if changes && pdo.sent != Some(pdo.map.packed(&read)) {
                pdo.due = !pdo.is_inhibited(now);
                // A PDO that is inhibited is looked at again in each turn.
                self.touched |= !pdo.due;
            }
        }
    }

    /// Finds the event-driven PDOs that are to be sent, because their event timer is over. To be called after each
    /// turn.
    pub(crate) fn look_at_timers(&mut self, now: Micros) {
        for pdo in self.transmit.iter_mut().filter(|pdo| pdo.is_event_driven() && pdo.timer > Micros(0)) {
            pdo.due |= now.since(pdo.at) >= pdo.timer && !pdo.is_inhibited(now);
        }
    }

    /// True while there is one to be sent.
    pub(crate) fn are_due(&self) -> bool {
        self.transmit.iter().any(|pdo| pdo.due)
    }

    /// The next PDO to be sent, with the data as they are now.
    pub(crate) fn next(&mut self, now: Micros, read: impl Fn(E) -> u32) -> Option<Frame> {
        for pdo in self.transmit.iter_mut().filter(|pdo| pdo.due) {
            let data = pdo.map.packed(&read);
            (pdo.due, pdo.sent, pdo.at, pdo.syncs) = (false, Some(data), now, 0);
            if let Some(id) = pdo.id.filter(|_| !pdo.map.is_empty()) {
                return Frame::standard(id, data.get(..pdo.map.length.into())?);
            }
        }
        None
    }
}
