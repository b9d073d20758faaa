//! A module whose motion controller does not always hear what is written to it.

use std::cell::Cell;
use std::rc::Rc;

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use hal_sim::board::{Board, Chip, SharedBoard, SimPin, SimSpi};
use hal_sim::clock::{MICROSECOND, MILLISECOND};
use hal_sim::control::Line;
use hal_sim::world::config::WorldConfig;
use tmcm::module::{Inputs, Module, Outcome, Parts, Platform, Source, TMCM_1140};
use tmcm::store::Store;
use tmcm::tmcl::{Reply, Status, text};
use tmcm::units::Micros;
use tmcm::vm::ErrorFlag;

/// The motion controller behind a bus on which nothing can be written at times: so many datagrams do not get through.
pub struct Loose(SimSpi, Rc<Cell<u32>>);

/// For as long as nobody mends it.
pub const BROKEN: u32 = u32::MAX;

impl ErrorType for Loose {
    type Error = ErrorKind;
}

impl SpiDevice for Loose {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        // Bit 0 of the first byte tells a read from a write.
        let write = matches!(operations, [Operation::TransferInPlace([first, ..])] if *first & 1 == 0);
        if self.1.get() > 0 && write {
            self.1.set(self.1.get() - 1);
            return Err(ErrorKind::Other);
        }
        self.0.transaction(operations).map_err(|never| match never {})
    }
}

impl Platform for Loose {
    type Tmc429 = Loose;
    type Tmc262 = SimSpi;
    type Enable = SimPin;
    type Store = Box<Store>;
    type Hooks = ();
}

/// A module on such a bus, in virtual time.
pub struct LooseBench {
    pub board: SharedBoard,
    pub module: Module<Loose, 1>,
    pub fails: Rc<Cell<u32>>,
}

impl LooseBench {
    /// In the default world, undisturbed.
    pub fn new() -> Self {
        Self::on(SharedBoard::new(Board::new(&WorldConfig::default(), 1)), 0)
    }

    /// On a board, whose bus is disturbed for so many datagrams from the start.
    pub fn on(board: SharedBoard, disturbed: u32) -> Self {
        let fails = Rc::new(Cell::new(disturbed));
        let parts = Parts {
            tmc429: Loose(board.spi(Chip::Tmc429, 1_000_000), fails.clone()),
            tmc262: [board.spi(Chip::Tmc262, 1_000_000)],
            enable: board.enable_pin(),
            store: Box::new(Store::new()),
            hooks: (),
        };
        let mut module = Module::new(&TMCM_1140, parts, 1);
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
        let done = matches!(outcome, Outcome::Pending | Outcome::Reply(Reply::Plain { status: Status::Ok, .. }));
        assert!(done, "{line}: {outcome:?}");
    }

    /// Lets polls pass.
    pub fn run(&mut self, milliseconds: u64) {
        for _ in 0..milliseconds {
            let next = self.board.borrow().now() + MILLISECOND;
            self.board.borrow_mut().advance_to(next);
            let seen = self.board.borrow().inputs();
            let inputs = Inputs {
                supply: Some(seen.supply),
                stall: seen.stall,
                encoder: seen.encoder,
                temperature: 25,
                ..Inputs::default()
            };
            let now = self.now();
            self.module.poll(now, &inputs);
        }
    }

    /// A command of the control protocol.
    pub fn control(&mut self, line: &str) {
        Line::parse(line).unwrap().control.apply(&mut self.board.borrow_mut());
    }

    /// The motor's speed as the chip has it.
    pub fn speed(&self) -> i32 {
        self.board.borrow().tmc429().velocity(0)
    }

    /// Whether an error flag is set.
    pub fn raised(&self, flag: ErrorFlag) -> bool {
        self.module.machine().errors.raised(flag)
    }
}
