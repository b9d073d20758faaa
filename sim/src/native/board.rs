//! The simulated board as a firmware sees it: chips over SPI, the enable pin, inputs and outputs.

use std::fmt::Debug;
use std::marker::PhantomData;

use hal_sim::board::{Chip, SharedBoard, SimPin, SimSpi};
use hal_sim::world::{self, stage::Abn};
use tmcm::chip::tmc429::Tmc429;
use tmcm::chip::tmc5160::Tmc5160;
use tmcm::device::{self, Controller, Inputs, Outputs, Parts};
use tmcm::module::{Hooks, Platform, Product};
use tmcm::motion::tmc429::Tmc429Tmc262;
use tmcm::motion::tmc5160::Tmc5160Axis;
use tmcm::motion::{Foreseeable, Sensors};
use tmcm::product;
use tmcm::store::{Memory, Store};

/// The motion controllers and drivers on a product's board, as a firmware reaches them.
pub trait Motion: Debug + 'static {
    /// The hardware that an axis runs on.
    type Hardware: Foreseeable;

    /// The motion controller of this number.
    fn controller(board: &SharedBoard, number: usize) -> Controller<Self::Hardware>;

    /// The hardware that each axis runs on, in the order of their numbers.
    fn axes<const AXES: usize>(board: &SharedBoard) -> [Self::Hardware; AXES];
}

/// A TMC429 for each three axes, with a TMC262 for each of them.
#[derive(Debug)]
pub struct Tmc429s;

impl Tmc429s {
    /// SPI clock of the TMC429s: 84 MHz / 64, as on the target.
    const CONTROLLER_HZ: u32 = 1_312_500;
    /// SPI clock of the TMC262s: 84 MHz / 32, as on the target.
    const DRIVER_HZ: u32 = 2_625_000;

    /// Number of motion controllers for so many axes.
    pub(super) const fn controllers(axes: u8) -> usize {
        axes.div_ceil(3) as usize
    }
}

impl Motion for Tmc429s {
    type Hardware = Tmc429Tmc262<SimSpi, SimSpi>;

    fn controller(board: &SharedBoard, number: usize) -> Controller<Self::Hardware> {
        Controller::new(Tmc429::new(board.spi(Chip::Tmc429(number), Self::CONTROLLER_HZ)))
    }

    fn axes<const AXES: usize>(board: &SharedBoard) -> [Self::Hardware; AXES] {
        Tmc429Tmc262::axes(std::array::from_fn(|axis| board.spi(Chip::Tmc262(axis), Self::DRIVER_HZ)))
    }
}

/// A TMC5160 for each axis.
#[derive(Debug)]
pub struct Tmc5160s;

impl Tmc5160s {
    /// SPI clock of the TMC5160s: 84 MHz / 16, as on the target.
    const HZ: u32 = 5_250_000;

    /// Number of motion controllers for so many axes.
    pub(super) const fn controllers(axes: u8) -> usize {
        axes as usize
    }
}

impl Motion for Tmc5160s {
    type Hardware = Tmc5160Axis<SimSpi>;

    fn controller(board: &SharedBoard, number: usize) -> Controller<Self::Hardware> {
        Controller::new(Tmc5160::new(board.spi(Chip::Tmc5160(number), Self::HZ)))
    }

    fn axes<const AXES: usize>(_: &SharedBoard) -> [Self::Hardware; AXES] {
        Tmc5160Axis::axes()
    }
}

/// A product that has a simulated board.
pub trait Wired: Memory + 'static {
    /// The chips that move its motors.
    type Motion: Motion;
}

macro_rules! wired {
    ($($product:ident $spec:ident $chips:ident;)*) => {
        $(impl Wired for product::$product {
            type Motion = $chips;
        })*
    };
}
tmcm::products!(wired);

impl Wired for product::Tmcm1140Canopen {
    type Motion = <product::Tmcm1140 as Wired>::Motion;
}

/// A simulated board as a firmware has it, with additions `H` of a platform, for a product `P` with `N` motion
/// controllers.
#[derive(Debug)]
pub struct Simulated<H, P = product::Tmcm1140, const N: usize = 1>(PhantomData<(H, P)>);

impl<H: Hooks, P: Wired, const N: usize> device::Circuit for Simulated<H, P, N> {
    type Product = P;
    type Hardware = <P::Motion as Motion>::Hardware;
    type Controllers = [Controller<Self::Hardware>; N];
    type Enable = SimPin;
    type Store = Box<Store<P>>;
}

impl<H: Hooks, P: Wired + Product, const N: usize> Platform for Simulated<H, P, N> {
    type Hooks = H;
}

/// The parts of which a device on a simulated board is made.
pub fn parts<H: Hooks, P: Wired, const AXES: usize, const N: usize>(
    board: &SharedBoard,
) -> Parts<Simulated<H, P, N>, AXES> {
    Parts {
        controllers: std::array::from_fn(|number| P::Motion::controller(board, number)),
        axes: P::Motion::axes(board),
        enable: board.enable_pin(),
        store: Box::new(Store::new()),
    }
}

/// Counts how often an encoder's null track has become low and high, so that each edge is told the firmware once.
#[derive(Clone, Copy, Debug, Default)]
struct NullEdges([u64; 2]);

impl NullEdges {
    /// The counts of the encoder at the last edges since the call before.
    fn take(&mut self, abn: Abn) -> [Option<u16>; 2] {
        let edges = [abn.null_low, abn.null_high];
        let before = std::mem::replace(&mut self.0, edges.map(|edge| edge.times));
        std::array::from_fn(|n| (edges[n].times != before[n]).then_some(edges[n].count as u16))
    }
}

/// Reads the inputs of a board, and writes its outputs.
#[derive(Debug)]
pub(super) struct Signals<const AXES: usize> {
    board: SharedBoard,
    null_edges: [NullEdges; AXES],
}

impl<const AXES: usize> Signals<AXES> {
    /// The signals of a board; edges of encoders before now are not told any more.
    pub(super) fn new(board: &SharedBoard) -> Self {
        let mut signals = Signals { board: board.clone(), null_edges: [NullEdges::default(); AXES] };
        signals.read();
        signals
    }

    pub(super) fn read(&mut self) -> Inputs<AXES> {
        let board = self.board.borrow();
        let seen = board.inputs();
        let mut analog = [0; device::ANALOG];
        for (port, value) in board.kind().analog().zip(seen.analog) {
            if let Some(place) = analog.get_mut(port) {
                *place = value;
            }
        }
        let axes = std::array::from_fn(|number| {
            let axis = board.axis_inputs(number);
            let null = self.null_edges[number].take(axis.abn);
            let external = axis.abn.count as u16;
            Sensors { stall: axis.stall, home: axis.home, right: axis.right, encoder: axis.encoder, external, null }
        });
        let temperature = seen.temperature.clamp(i16::MIN.into(), i16::MAX.into()) as i16;
        Inputs { axes, digital: seen.digital as u16, analog, supply: Some(seen.supply), temperature }
    }

    pub(super) fn write(&self, outputs: &Outputs) {
        self.board.borrow_mut().set_outputs(world::Outputs {
            digital: outputs.digital.into(),
            pull_ups: outputs.pull_ups.into(),
            leds: [outputs.led, outputs.trouble],
        });
    }
}
