//! The EEPROM at work: what the node is told of it.

use super::Node;
use super::cia301::abort::Abort;
use super::errors::Emergency;
use crate::device::Board;
use crate::executor::Product;
use crate::store::{Finished, Need, Store};

impl<T: Board<Product: Product>> Node<T> {
    /// True when all that was saved is durable.
    pub fn is_settled(&self) -> bool {
        self.device.store().settled(Need::Settings)
    }

    /// Tells the node how the EEPROM job that it gave out last has gone. An SDO request that waits for it is answered:
    /// confirmed if all it saved is written.
    pub fn stored(&mut self, written: bool) {
        let Finished { failed, worn, answers, .. } = self.device.store_mut().finish(written);
        // A node without an address starts anew, to read it.
        if answers && !self.identity.known {
            self.device.restart_at(self.now);
        }
        if worn {
            self.raise(Emergency::SettingsWorn);
        }
        if failed.is_some() {
            self.services.server.conclude(Err(Abort::Hardware));
        } else if self.is_settled() {
            self.services.server.conclude(Ok(()));
            let store = self.device.store();
            // What was lost has been replaced. Of an EEPROM that is silent, and is only asked again, all is lost.
            if store.lost() == 0 && !store.is_unreachable() {
                self.lost = Default::default();
            }
        }
    }

    /// The settings on their way to the EEPROM: the caller takes jobs from here and reports how they went.
    pub fn store(&mut self) -> &mut Store<T::Product> {
        self.device.store_mut()
    }
}
