//! The values of those objects that are settings, in RAM.

use super::address::Address;
use super::cia301::control::Times;
use super::cia301::pdo::PDOS;
use super::cia301::record::{Direction, Record};
use super::cia301::{Map, cob};
use super::entry::{CELLS, Entry};
use super::object::{Object, ROWS};
use crate::units::Micros;

/// The value of each setting, as [`Type::extend`](super::Type::extend) gives it.
#[derive(Clone, Debug)]
pub(super) struct Values([u32; CELLS]);

impl Values {
    /// The defaults of a node with this ID.
    pub(super) fn of(node: u8) -> Self {
        let mut values = Values([0; CELLS]);
        for entry in entries() {
            values.set(entry, entry.row().default_number(entry.nth, node));
        }
        values
    }

    /// The value of a setting; 0 for a computed object.
    pub(super) fn get(&self, entry: Entry) -> u32 {
        entry.cell().and_then(|cell| self.0.get(cell)).copied().unwrap_or_default()
    }

    /// The value of a setting that no PDO has.
    pub(super) fn of_object(&self, object: Object) -> u32 {
        self.get(Entry::of(object))
    }

    /// Changes the value of a setting; a computed object is ignored.
    pub(super) fn set(&mut self, entry: Entry, value: u32) {
        if let Some(place) = entry.cell().and_then(|cell| self.0.get_mut(cell)) {
            *place = value;
        }
    }

    /// Changes the values of several settings.
    pub(super) fn set_all<const N: usize>(&mut self, changes: [(Entry, u32); N]) {
        changes.into_iter().for_each(|(entry, value)| self.set(entry, value));
    }

    /// The value of an object in milliseconds.
    pub(super) fn milliseconds(&self, object: Object) -> Micros {
        Micros::from_millis(self.of_object(object).into())
    }

    /// The times of error control.
    pub(super) fn times(&self) -> Times {
        let life =
            u64::from(self.of_object(Object::GuardTime)).saturating_mul(self.of_object(Object::LifeTimeFactor).into());
        Times {
            heartbeat: self.milliseconds(Object::ProducerHeartbeatTime),
            master: Micros::from_millis(u64::from(self.of_object(Object::ConsumerHeartbeatTime) as u16)),
            life: Micros::from_millis(life),
        }
    }

    /// The node whose heartbeat is watched; `None` if none is.
    pub(super) fn watched(&self) -> Option<u16> {
        let consumer = self.of_object(Object::ConsumerHeartbeatTime);
        let node = consumer >> 16;
        ((1..=127).contains(&node) && consumer as u16 != 0).then_some(node as u16)
    }

    /// Makes an address that of the next start, which a save takes along.
    pub(super) fn set_address(&mut self, address: Address) {
        self.set(Entry::of(Object::NodeId), address.node.into());
        self.set(Entry::of(Object::BitRate), address.bit_rate.into());
    }

    /// The CAN identifier of the SYNC.
    pub(super) fn sync_id(&self) -> u16 {
        cob::can_id(self.of_object(Object::SyncCobId))
    }

    /// The record of a PDO.
    pub(super) fn record(&self, direction: Direction, nth: u8) -> Record {
        let value = |object| self.get(Entry { object, nth });
        let time = |object| Micros::from_millis(value(object).into());
        match direction {
            Direction::Receive => Record {
                cob_id: value(Object::ReceiveCobId),
                kind: value(Object::ReceiveType) as u8,
                count: value(Object::ReceiveMapped) as u8,
                entries: RECEIVED.map(value),
                ..Record::default()
            },
            Direction::Transmit => Record {
                cob_id: value(Object::TransmitCobId),
                kind: value(Object::TransmitType) as u8,
                inhibit: time(Object::TransmitInhibitTime),
                timer: time(Object::TransmitEventTimer),
                count: value(Object::TransmitMapped) as u8,
                entries: TRANSMITTED.map(value),
            },
        }
    }

    /// Gives PDOs their default mapping where the record says something impossible: a power cut may have left a part of
    /// an older one in the EEPROM.
    pub(super) fn mend_mappings(&mut self, node: u8) {
        for (direction, nth) in pdos() {
            if Map::of(&self.record(direction, nth), direction, Entry::described).is_ok() {
                continue;
            }
            let (count, entries) = match direction {
                Direction::Receive => (Object::ReceiveMapped, RECEIVED),
                Direction::Transmit => (Object::TransmitMapped, TRANSMITTED),
            };
            for object in entries.into_iter().chain([count]) {
                let entry = Entry { object, nth };
                self.set(entry, entry.row().default_number(nth, node));
            }
        }
    }
}

/// The mapping entries of a PDO that the node receives, and of one that it sends.
const RECEIVED: [Object; 3] = [Object::ReceiveEntry1, Object::ReceiveEntry2, Object::ReceiveEntry3];
const TRANSMITTED: [Object; 3] = [Object::TransmitEntry1, Object::TransmitEntry2, Object::TransmitEntry3];

/// All PDOs, by direction and number.
pub(super) fn pdos() -> impl Iterator<Item = (Direction, u8)> {
    (0..PDOS).flat_map(|nth| [(Direction::Receive, nth), (Direction::Transmit, nth)])
}

/// All objects, those of the PDOs once for each PDO.
pub(super) fn entries() -> impl Iterator<Item = Entry> {
    Object::ALL.iter().zip(&ROWS).flat_map(|(object, row)| {
        let object = *object;
        (0..row.count()).map(move |nth| Entry { object, nth })
    })
}
