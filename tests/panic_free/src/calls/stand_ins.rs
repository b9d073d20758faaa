//! Stand-ins for the board: chips, pins and links that answer anything, or fail.

use core::fmt::{self, Write};
use core::hint::black_box as any;
use core::marker::PhantomData;

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};
use tmcm::can::Frame;
use tmcm::canopen::{Bus, BusState, Filters};
use tmcm::chip::tmc429::Tmc429;
use tmcm::chip::tmc5160::Tmc5160;
use tmcm::device::{Circuit, Controller, Controllers, Outputs, Parts};
use tmcm::firmware::Surroundings;
use tmcm::module::{Execute, Hooks, LinkEnds, LinkMode, LinkSettings, Origin, Platform, Product, Request, Source};
use tmcm::motion::Foreseeable;
use tmcm::motion::tmc429::Tmc429Tmc262;
use tmcm::motion::tmc5160::Tmc5160Axis;
use tmcm::product::{Tmcm1140, Tmcm1140Canopen, Tmcm3212, Tmcm6110};
use tmcm::store::{Job, Store};
use tmcm::tmcl::binary::Addressed;
use tmcm::tmcl::{Command, Reply, Status};
use tmcm::units::Micros;

use super::now;

/// A chip that answers anything, or fails.
pub(super) struct Chip;

impl spi::ErrorType for Chip {
    type Error = spi::ErrorKind;
}

impl SpiDevice for Chip {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::ErrorKind> {
        any(operations);
        any(Ok(()))
    }
}

/// A pin that may fail.
pub(super) struct Pin;

impl digital::ErrorType for Pin {
    type Error = digital::ErrorKind;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), digital::ErrorKind> {
        any(Ok(()))
    }

    fn set_high(&mut self) -> Result<(), digital::ErrorKind> {
        any(Ok(()))
    }
}

/// A product with `AXES` axes on its chips.
pub(super) trait Built<const AXES: usize>: Product + 'static {
    type Hardware: Foreseeable;
    type Controllers: Controllers<Self::Hardware>;

    fn chips() -> (Self::Controllers, [Self::Hardware; AXES]);
}

impl Built<1> for Tmcm1140 {
    type Hardware = Tmc429Tmc262<Chip, Chip>;
    type Controllers = [Controller<Self::Hardware>; 1];

    fn chips() -> (Self::Controllers, [Self::Hardware; 1]) {
        ([Controller::new(Tmc429::new(Chip))], Tmc429Tmc262::axes([Chip]))
    }
}

impl Built<6> for Tmcm6110 {
    type Hardware = Tmc429Tmc262<Chip, Chip>;
    type Controllers = [Controller<Self::Hardware>; 2];

    fn chips() -> (Self::Controllers, [Self::Hardware; 6]) {
        ([(); 2].map(|()| Controller::new(Tmc429::new(Chip))), Tmc429Tmc262::axes([const { Chip }; 6]))
    }
}

impl Built<3> for Tmcm3212 {
    type Hardware = Tmc5160Axis<Chip>;
    type Controllers = [Controller<Self::Hardware>; 3];

    fn chips() -> (Self::Controllers, [Self::Hardware; 3]) {
        ([(); 3].map(|()| Controller::new(Tmc5160::new(Chip))), Tmc5160Axis::axes())
    }
}

/// All of it.
pub(super) struct Bare<P, const AXES: usize>(PhantomData<P>);

impl<P: Built<AXES>, const AXES: usize> Circuit for Bare<P, AXES> {
    type Product = P;
    type Hardware = P::Hardware;
    type Controllers = P::Controllers;
    type Enable = Pin;
    type Store = &'static mut Store<P>;
}

impl<P: Built<AXES>, const AXES: usize> Platform for Bare<P, AXES> {
    type Hooks = Added;
}

/// The parts of a product; `None` as long as the compiler cannot know that there is a store.
pub(super) fn parts<P: Built<AXES>, const AXES: usize>() -> Option<Parts<Bare<P, AXES>, AXES>> {
    let (controllers, axes) = P::chips();
    let store: Option<&'static mut Store<P>> = any(None);
    Some(Parts { controllers, axes, enable: Pin, store: store? })
}

/// The board of a CANopen node.
pub(super) struct BareNode;

impl Circuit for BareNode {
    type Product = Tmcm1140Canopen;
    type Hardware = Tmc429Tmc262<Chip, Chip>;
    type Controllers = [Controller<Self::Hardware>; 1];
    type Enable = Pin;
    type Store = &'static mut Store<Tmcm1140Canopen>;
}

/// User functions of which nothing is known.
#[derive(Default)]
pub(super) struct Added;

impl Hooks for Added {
    fn call(&mut self, number: u8, command: Command, module: &mut impl Execute) -> Result<i32, Status> {
        any((number, command));
        let _ = any(module.execute(any(command)));
        any(module.registers());
        let _ = any(module.axis_parameter(any(0), any(0)));
        let _ = any(module.set_axis_parameter(any(0), any(0), any(0)));
        let _ = any(module.global_parameter(any(0), any(0)));
        let _ = any(module.set_global_parameter(any(0), any(0), any(0)));
        let _ = any(module.variable(any(0)));
        let _ = any(module.set_variable(any(0), any(0)));
        let _ = any(module.input(any(0), any(0)));
        let _ = any(module.set_output(any(0), any(false)));
        let _ = any(module.rotate(any(0), any(0)));
        let _ = any(module.stop(any(0)));
        let _ = any(module.move_to(any(0), any(0)));
        let _ = any(module.move_by(any(0), any(0)));
        any(Ok(0))
    }
}

/// Links that bring anything.
pub(super) struct Nobody;

impl Surroundings for Nobody {
    type Bus = Self;

    fn bus(&mut self) -> Option<&mut Self> {
        if any(true) { Some(self) } else { None }
    }

    fn set(&mut self, outputs: &Outputs) {
        any(outputs);
    }

    fn keep(&mut self, next: impl FnOnce() -> Option<Job>) -> Option<bool> {
        if any(true) {
            any(next());
        }
        any(Some(true))
    }

    fn put_in_force(&mut self, settings: &LinkSettings) {
        any(settings);
    }

    fn restart(&mut self) {}
}

impl Bus for Nobody {
    fn state(&self) -> BusState {
        any(BusState::Off)
    }

    fn listen_to(&mut self, filters: &Filters) {
        any(filters);
    }

    fn read(&mut self) -> Option<Frame> {
        any(None)
    }

    fn has_overrun(&mut self) -> bool {
        any(true)
    }

    fn settle(&mut self) {}

    fn has_room(&self) -> bool {
        any(true)
    }

    fn is_empty(&self) -> bool {
        any(true)
    }

    fn write(&mut self, frame: &Frame) {
        any(frame);
    }

    fn clear(&mut self) {}

    fn wait(&mut self, waits: bool) {
        any(waits);
    }
}

impl LinkEnds for Nobody {
    fn now(&self) -> Micros {
        now()
    }

    fn request(&mut self, source: Source, settings: &LinkSettings) -> Option<Request> {
        any((source, settings));
        any(Some(Request::Telegram(Addressed::default())))
    }

    fn takes_event(&mut self, source: Source) -> bool {
        any(source);
        any(true)
    }

    fn answer(&mut self, to: Origin, reply: Option<&Reply>, mode: Option<LinkMode>, settings: &LinkSettings) {
        any((to, reply, mode, settings));
    }
}

/// Takes any text, or fails.
pub(super) struct Paper;

impl Write for Paper {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        any(text);
        any(Ok(()))
    }
}
