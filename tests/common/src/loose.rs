//! A module behind whose SPI bus the motion controller loses some write datagrams.

use std::cell::Cell;
use std::rc::Rc;
use std::task::Poll;

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use hal_sim::board::{Board, Chip, SharedBoard, SimPin, SimSpi};
use hal_sim::clock::{MICROSECOND, MILLISECOND};
use hal_sim::control::Line;
use hal_sim::world::config::WorldConfig;
use tmcm::chip::tmc429::Tmc429;
use tmcm::device::{self, Controller, Inputs, Parts};
use tmcm::module::{Module, Platform, Source};
use tmcm::motion::Sensors;
use tmcm::motion::tmc429::Tmc429Tmc262;
use tmcm::product::Tmcm1140;
use tmcm::store::Store;
use tmcm::tmcl::{Reply, Status, text};
use tmcm::units::Micros;
use tmcm::vm::ErrorFlag;

/// The SPI bus to the motion controller, on which write datagrams are lost as [`Disturbance`] says.
pub struct Loose(SimSpi, Rc<Disturbance>);

/// The disturbance of the bus: after `spared` write datagrams the next `fails` ones end with an error. With `heard`
/// they reach the chip all the same.
#[derive(Default)]
pub struct Disturbance {
    spared: Cell<u32>,
    fails: Cell<u32>,
    heard: Cell<bool>,
}

impl Disturbance {
    /// Lets the next `fails` write datagrams be lost.
    pub fn set(&self, fails: u32) {
        self.after(0, fails, false);
    }

    /// Lets `fails` write datagrams fail after `spared` ones that do not. With `heard` they reach the chip, but the
    /// firmware gets an error in place of the answer.
    pub fn after(&self, spared: u32, fails: u32, heard: bool) {
        self.spared.set(spared);
        self.fails.set(fails);
        self.heard.set(heard);
    }

    /// Number of datagrams that are still to fail.
    pub fn get(&self) -> u32 {
        self.fails.get()
    }

    /// Counts a write datagram; true if it fails.
    fn strikes(&self) -> bool {
        let left = if self.spared.get() > 0 { &self.spared } else { &self.fails };
        let strikes = self.spared.get() == 0 && self.fails.get() > 0;
        left.set(left.get().saturating_sub(1));
        strikes
    }
}

/// Number of failing datagrams that stands for a bus that stays broken.
pub const BROKEN: u32 = u32::MAX;

impl ErrorType for Loose {
    type Error = ErrorKind;
}

impl SpiDevice for Loose {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let Loose(bus, disturbance) = self;
        // Bit 0 of the first byte tells a read from a write.
        let write = matches!(operations, [Operation::TransferInPlace([first, ..])] if *first & 1 == 0);
        let lost = write && disturbance.strikes();
        if !lost || disturbance.heard.get() {
            bus.transaction(operations).map_err(|never| match never {})?;
        }
        if lost { Err(ErrorKind::Other) } else { Ok(()) }
    }
}

impl device::Circuit for Loose {
    type Product = Tmcm1140;
    type Hardware = Tmc429Tmc262<Loose, SimSpi>;
    type Controllers = [Controller<Self::Hardware>; 1];
    type Enable = SimPin;
    type Store = Box<Store<Tmcm1140>>;
}

impl Platform for Loose {
    type Hooks = ();
}

/// A module on a disturbed bus, in virtual time.
pub struct LooseBench {
    /// The board, with its chips and its world.
    pub board: SharedBoard,
    /// The firmware.
    pub module: Module<Loose, 1>,
    /// The disturbances of the bus.
    pub fails: Rc<Disturbance>,
}

impl LooseBench {
    /// A module in the default world, whose bus is not disturbed yet.
    pub fn new() -> Self {
        Self::on(SharedBoard::new(Board::new(&WorldConfig::default(), 1)), 0)
    }

    /// A module on `board`, for which the first `disturbed` write datagrams are lost.
    pub fn on(board: SharedBoard, disturbed: u32) -> Self {
        let fails = Rc::new(Disturbance::default());
        fails.set(disturbed);
        let parts = Parts {
            controllers: [Controller::new(Tmc429::new(Loose(board.spi(Chip::Tmc429(0), 1_000_000), fails.clone())))],
            axes: Tmc429Tmc262::axes([board.spi(Chip::Tmc262(0), 1_000_000)]),
            enable: board.enable_pin(),
            store: Box::new(Store::new()),
        };
        let mut module = Module::new(parts, (), 1);
        module.start(Micros(0), |_| {});
        LooseBench { board, module, fails }
    }

    /// The present time of the module.
    pub fn now(&self) -> Micros {
        Micros(self.board.borrow().now() / MICROSECOND)
    }

    /// Executes a command, which must succeed.
    pub fn ok(&mut self, line: &str) {
        let outcome = self.module.execute(self.now(), Source::Usb, text::parse(line).unwrap());
        // A setting takes effect before it is durable, so a pending reply counts as success.
        let done = matches!(outcome, Poll::Pending | Poll::Ready(Some(Reply::Plain { status: Status::Ok, .. })));
        assert!(done, "{line}: {outcome:?}");
    }

    /// Lets virtual time pass, and looks at the module once per millisecond.
    pub fn run(&mut self, milliseconds: u64) {
        for _ in 0..milliseconds {
            let next = self.board.borrow().now() + MILLISECOND;
            self.board.borrow_mut().advance_to(next);
            let (seen, axis) = (self.board.borrow().inputs(), self.board.borrow().axis_inputs(0));
            let inputs = Inputs {
                supply: Some(seen.supply),
                axes: [Sensors { stall: axis.stall, encoder: axis.encoder, ..Sensors::default() }],
                temperature: 25,
                ..Inputs::default()
            };
            let now = self.now();
            while self.module.deadline() <= now {
                self.module.poll(now, &inputs);
            }
        }
    }

    /// Carries out a command of the control protocol, as `tmcl sim --control` takes it.
    pub fn control(&mut self, line: &str) {
        Line::parse(line).unwrap().control.apply(&mut self.board.borrow_mut()).unwrap();
    }

    /// The motor's speed in internal units, read from the model of the motion controller.
    pub fn speed(&self) -> i32 {
        self.board.borrow().tmc429(0).velocity(0)
    }

    /// True if an error flag is set.
    pub fn raised(&self, flag: ErrorFlag) -> bool {
        self.module.machine().errors.raised(flag)
    }
}
