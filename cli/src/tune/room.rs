//! The progress bar makes room where the motor is loaded, because the user may be asked to do that.

use std::cell::RefCell;

use tmcl_tools::failure::Failure;
use tmcl_tools::tune::{Brake, Drive};

use crate::progress::Bar;

/// A brake that loads the motor, below a bar that makes room for it.
pub(super) struct WithRoom<'a> {
    pub(super) brake: Box<dyn Brake>,
    pub(super) bar: &'a RefCell<Bar>,
}

impl Brake for WithRoom<'_> {
    fn hold(&mut self, drive: &mut Drive<'_, '_>) -> Result<String, Failure> {
        self.bar.borrow_mut().pause();
        self.brake.hold(drive)
    }

    fn release(&mut self, drive: &mut Drive<'_, '_>) -> Result<(), Failure> {
        self.bar.borrow_mut().pause();
        self.brake.release(drive)
    }

    fn lost(&mut self, drive: &mut Drive<'_, '_>) -> Result<i64, Failure> {
        self.brake.lost(drive)
    }

    fn let_go(&mut self) {
        self.brake.let_go();
    }
}
