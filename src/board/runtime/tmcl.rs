//! The TMCL firmware on a board.

use super::runs::Runs;
use crate::board::boards::chosen::AXES;
use crate::board::stm32f4::can_tmcl::TmclLink;
use crate::module::{Module, Platform};

impl<T: Platform<Hooks: Default> + 'static> Runs for Module<T, AXES> {
    type Can = TmclLink;

    fn introduce(&self) {
        defmt::info!("module runs at address {=u8}", self.link_settings().address);
    }
}
