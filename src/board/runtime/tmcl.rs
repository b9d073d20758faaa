//! The TMCL firmware as the owner serves it.

use super::ends::Ends;
use super::firmware::Firmware;
use crate::board::stm32f4::can::{self, Identifiers};
use crate::can::StandardId;
use crate::device::{Inputs, Outputs, Parts};
use crate::module::{LinkSettings, Module, Platform, Product, Source, deliver, factory_reset, serve};
use crate::store::{Job, Store};
use crate::units::Micros;

/// A module of TMCL. The module comes first: see [`Module`].
#[repr(C)]
pub struct Tmcl<T: Platform<Hooks = ()> + 'static, const AXES: usize> {
    module: Module<T, AXES>,
    /// Identifiers of requests and of replies with which CAN was told what to bring.
    told: Option<[Option<StandardId>; 3]>,
}

impl<T: Platform<Hooks = ()> + 'static, const AXES: usize> Tmcl<T, AXES> {
    /// The identifiers of the frames that are to come from the CAN bus, if they are not those of the last call.
    ///
    /// A module whose own identifier is that of replies receives everything, as it must know the requests to other
    /// modules to tell their replies from requests.
    #[inline]
    fn new_identifiers(&mut self) -> Option<Identifiers> {
        let LinkSettings { can_id, can_secondary, can_reply, .. } = *self.module.link_settings();
        let settings = Some([Some(can_id), can_secondary, Some(can_reply)]);
        if core::mem::replace(&mut self.told, settings) == settings {
            return None;
        }
        let own = [Some(can_id), can_secondary];
        Some((!own.contains(&Some(can_reply))).then(|| own.into_iter().flatten().collect()))
    }
}

impl<T: Platform<Hooks = ()> + 'static, const AXES: usize> Firmware<AXES> for Tmcl<T, AXES> {
    type Board = T;

    #[inline(always)]
    fn new(parts: Parts<T, AXES>, seed: u32) -> Self {
        Tmcl { module: Module::new(parts, (), seed), told: None }
    }

    fn start(&mut self, now: Micros, load: impl FnOnce(&mut Store<T::Product>)) {
        self.module.start(now, load);
        defmt::info!("module runs at address {=u8}", self.module.link_settings().address);
    }

    fn factory_reset(store: &mut Store<T::Product>) {
        factory_reset(store);
    }

    fn recover(&mut self) {
        self.module.hold_program();
    }

    fn usb_name(&self) -> &'static str {
        T::Product::SPEC.usb
    }

    fn baud_rate(&self) -> Option<u32> {
        Some(self.module.baud_rate())
    }

    fn can_bit_rate(&self) -> Option<u32> {
        Some(self.module.can_bit_rate())
    }

    #[inline(always)]
    fn link_settings(&self) -> &LinkSettings {
        self.module.link_settings()
    }

    const CAN_IN_ORDER: bool = true;

    #[inline(always)]
    fn serve(&mut self, ends: &mut Ends, now: impl Fn() -> Micros) -> bool {
        serve(&mut self.module, ends, now)
    }

    #[inline(always)]
    fn deadline(&self) -> Micros {
        self.module.deadline()
    }

    #[inline(always)]
    fn takes_inputs(&self, now: Micros) -> bool {
        self.module.takes_inputs(now)
    }

    #[inline(always)]
    fn poll(&mut self, now: Micros, inputs: &Inputs<AXES>) -> Option<Outputs> {
        self.module.poll(now, inputs)
    }

    #[inline(always)]
    fn deliver(&mut self, ends: &mut Ends) {
        deliver(&mut self.module, ends);
        if let Some(can) = &mut ends.can
            && let Some(identifiers) = self.new_identifiers()
        {
            can.listen_to(&identifiers);
        }
    }

    fn refill(&mut self, _: &mut Ends) {
        can::refill();
    }

    fn hold(&self) {
        can::hold();
    }

    #[inline(always)]
    fn has_sent(&self) -> bool {
        true
    }

    #[inline(always)]
    fn next_job(&mut self) -> Option<Job> {
        self.module.store().next_job()
    }

    #[inline(always)]
    fn stored(&mut self, written: bool) {
        self.module.stored(written);
    }

    fn forget(&mut self, source: Source) {
        self.module.forget(source);
    }
}
