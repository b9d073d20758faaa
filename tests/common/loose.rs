//! A module whose motion controller does not always hear what is written to it.

use std::cell::Cell;
use std::rc::Rc;
use std::task::Poll;

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use hal_sim::board::{Board, Chip, SharedBoard, SimPin, SimSpi};
use hal_sim::clock::{MICROSECOND, MILLISECOND};
use hal_sim::control::Line;
use hal_sim::world::config::WorldConfig;
use tmcm::module::{Inputs, Module, Parts, Platform, Source, Tmcm1140};
use tmcm::store::Store;
use tmcm::tmcl::{Reply, Status, text};
use tmcm::units::Micros;
use tmcm::vm::ErrorFlag;

/// The motion controller behind a bus on which nothing can be written at times.
pub struct Loose(SimSpi, Rc<Disturbance>);

/// What is the matter with the bus: after some datagrams so many do not get through.
#[derive(Default)]
pub struct Disturbance {
    spared: Cell<u32>,
    fails: Cell<u32>,
    heard: Cell<bool>,
}

impl Disturbance {
    /// The next so many datagrams are lost.
    pub fn set(&self, fails: u32) {
        self.after(0, fails, false);
    }

    /// So many datagrams are lost after some that are not; if they are `heard`, it is their answers that are lost.
    pub fn after(&self, spared: u32, fails: u32, heard: bool) {
        self.spared.set(spared);
        self.fails.set(fails);
        self.heard.set(heard);
    }

    /// How many datagrams are still to be lost.
    pub fn get(&self) -> u32 {
        self.fails.get()
    }

    /// Whether a datagram that comes now is lost.
    fn strikes(&self) -> bool {
        let left = if self.spared.get() > 0 { &self.spared } else { &self.fails };
        let strikes = self.spared.get() == 0 && self.fails.get() > 0;
        left.set(left.get().saturating_sub(1));
        strikes
    }
}

/// For as long as nobody mends it.
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

impl Platform for Loose {
    type Tmc429 = Loose;
    type Tmc262 = SimSpi;
    type Enable = SimPin;
    type Product = Tmcm1140;
    type Store = Box<Store<Tmcm1140>>;
    type Hooks = ();
}

/// A module on such a bus, in virtual time.
pub struct LooseBench {
    pub board: SharedBoard,
    pub module: Module<Loose, 1>,
    pub fails: Rc<Disturbance>,
}

impl LooseBench {
    /// In the default world, undisturbed.
    pub fn new() -> Self {
        Self::on(SharedBoard::new(Board::new(&WorldConfig::default(), 1)), 0)
    }

    /// On a board, whose bus is disturbed for so many datagrams from the start.
    pub fn on(board: SharedBoard, disturbed: u32) -> Self {
        let fails = Rc::new(Disturbance::default());
        fails.set(disturbed);
        let parts = Parts {
            tmc429: Loose(board.spi(Chip::Tmc429(0), 1_000_000), fails.clone()),
            tmc262: [board.spi(Chip::Tmc262(0), 1_000_000)],
            enable: board.enable_pin(),
            store: Box::new(Store::new()),
            hooks: (),
        };
        let mut module = Module::new(parts, 1);
        module.start(Micros(0), |_| {});
        LooseBench { board, module, fails }
    }

    /// The module's time.
    pub fn now(&self) -> Micros {
        Micros(self.board.borrow().now() / MICROSECOND)
    }

    /// Has a command carried out, which must succeed.
    pub fn ok(&mut self, line: &str) {
        let outcome = self.module.execute(self.now(), Source::Usb, text::parse(line).unwrap());
        // A setting that is stored is in force before it is durable.
        let done = matches!(outcome, Poll::Pending | Poll::Ready(Some(Reply::Plain { status: Status::Ok, .. })));
        assert!(done, "{line}: {outcome:?}");
    }

    /// Lets polls pass.
    pub fn run(&mut self, milliseconds: u64) {
        for _ in 0..milliseconds {
            let next = self.board.borrow().now() + MILLISECOND;
            self.board.borrow_mut().advance_to(next);
            let (seen, axis) = (self.board.borrow().inputs(), self.board.borrow().axis_inputs(0));
            let inputs = Inputs {
                supply: Some(seen.supply),
                stall: axis.stall,
                encoder: axis.encoder,
                temperature: 25,
                ..Inputs::default()
            };
            let now = self.now();
            self.module.poll(now, &inputs);
        }
    }

    /// A command of the control protocol.
    pub fn control(&mut self, line: &str) {
        Line::parse(line).unwrap().control.apply(&mut self.board.borrow_mut()).unwrap();
    }

    /// The motor's speed as the chip has it.
    pub fn speed(&self) -> i32 {
        self.board.borrow().tmc429(0).velocity(0)
    }

    /// Whether an error flag is set.
    pub fn raised(&self, flag: ErrorFlag) -> bool {
        self.module.machine().errors.raised(flag)
    }
}
