//! The TMCL firmware as a [`Firmware`].

use super::{Firmware, OnBoard, Surroundings};
use crate::device::{Inputs, Outputs, Parts};
use crate::module::{LinkSettings, Module, Platform, Product, Source, deliver, factory_reset, serve};
use crate::store::{Job, Store};
use crate::units::Micros;

impl<T: Platform, const AXES: usize> Firmware for Module<T, AXES> {
    type Inputs = Inputs<AXES>;

    #[inline(always)]
    fn serve(&mut self, around: &mut impl Surroundings) -> bool {
        serve(self, around)
    }

    #[inline(always)]
    fn deadline(&self) -> Micros {
        self.deadline()
    }

    #[inline(always)]
    fn takes_inputs(&self, now: Micros) -> bool {
        self.takes_inputs(now)
    }

    #[inline(always)]
    fn poll(&mut self, now: Micros, inputs: &Inputs<AXES>) -> Option<Outputs> {
        self.poll(now, inputs)
    }

    #[inline(always)]
    fn deliver(&mut self, around: &mut impl Surroundings) {
        deliver(self, around);
    }

    #[inline(always)]
    fn next_job(&mut self) -> Option<Job> {
        self.store().next_job()
    }

    #[inline(always)]
    fn stored(&mut self, written: bool) {
        self.stored(written);
    }

    fn usb_name(&self) -> &'static str {
        T::Product::SPEC.usb
    }

    #[inline(always)]
    fn link_settings(&self) -> &LinkSettings {
        self.link_settings()
    }

    fn baud_rate(&self) -> Option<u32> {
        Some(self.baud_rate())
    }

    fn can_bit_rate(&self) -> Option<u32> {
        Some(self.can_bit_rate())
    }

    fn recover(&mut self) {
        self.hold_program();
    }

    fn forget(&mut self, source: Source) {
        self.forget(source);
    }

    fn awaits(&self, source: Source) -> bool {
        self.awaits(source)
    }

    fn is_restarting(&self) -> bool {
        self.is_restarting()
    }
}

impl<T: Platform<Hooks: Default>, const AXES: usize> OnBoard<AXES> for Module<T, AXES> {
    type Circuit = T;

    #[inline(always)]
    fn new(parts: Parts<T, AXES>, seed: u32) -> Self {
        Module::new(parts, T::Hooks::default(), seed)
    }

    fn start(&mut self, now: Micros, load: impl FnOnce(&mut Store<T::Product>)) {
        self.start(now, load);
    }

    fn factory_reset(store: &mut Store<T::Product>) {
        factory_reset(store);
    }
}
