//! An axis to the poll, the datagram and the bit of its driver.

use crate::{Bench, OK};
use hal_sim::board::Chip;
use tmcm::module::Source;
use tmcm::tmcl::binary;
use tmcm::vm::ErrorFlag;
use tmcm_sim::VirtualModule;

impl Bench {
    /// A command that is carried out at once, over RS485, which has no frames to wait for: no poll passes.
    pub fn tell(&mut self, line: &str) {
        self.post(Source::Rs485, line);
        let sent = self.module.sent().unwrap_or_else(|| panic!("no reply to {line}"));
        assert_eq!(binary::decode_reply(&sent.telegram().unwrap()).unwrap().status, OK, "{line}");
    }

    /// The next so many polls of the axis, each of which begins a millisecond, with the readings between them.
    pub fn poll(&mut self, polls: usize) {
        // None of them is left out.
        self.module.skip(false);
        let mut left = polls;
        while left > 0 {
            left -= usize::from(self.module.begins_turn());
            let next = self.module.next_event().unwrap();
            self.module.run_until(next);
        }
    }

    /// The error flag that tells of a move that ended before its target.
    pub fn cut_short(&self) -> bool {
        self.module.machine().unwrap().errors.raised(ErrorFlag::Position)
    }

    /// Datagrams that the motion controller has had.
    pub fn datagrams(&self) -> u64 {
        self.module.board().borrow().datagrams(Chip::Tmc429(0))
    }

    /// The current that the driver is told, in 1/32: what coolStep makes of it left out.
    pub fn scale(&self) -> u32 {
        (self.module.board().borrow().tmc262(0).registers().sgcsconf & 0x1F) + 1
    }
}
