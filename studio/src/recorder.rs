//! Rows of values of a virtual module, which are looked at without letting its time pass.

use hal_sim::clock::{MILLISECOND, Nanos};
use tmcl_tools::calc::{Live, Settings};
use tmcl_tools::product::speed_unit;
use tmcm::param::Unit;
use tmcm::tmcl::text;
use tmcm_sim::fleet::Fleet;
use tmcm_sim::protocol::Seen as Looking;
use tmcm_sim::{Product, VirtualModule};

use crate::scope::{Seen, Watched, seen};
use crate::types::SampleRow;

/// Time between two rows.
const EVERY: Nanos = MILLISECOND;

/// A row at each millisecond of a virtual module.
#[derive(Debug)]
pub struct Recorder {
    product: Product,
    /// The values that are looked at, one for each curve; `None` for one that can only be asked for.
    seen: Vec<Option<Seen>>,
    /// Whether each of them is a value of the firmware: without power there are none.
    of_firmware: Vec<bool>,
    due: Nanos,
    rows: Vec<SampleRow>,
}

impl Recorder {
    /// Rows of these curves, the first one with the next millisecond after `now`.
    pub fn new(Watched { texts }: &Watched, product: Product, now: Nanos) -> Self {
        let seen = texts.iter().map(|text| seen(text, product).ok()).collect();
        let of_firmware = texts.iter().map(|text| text::parse(text).is_ok()).collect();
        Recorder { product, seen, of_firmware, due: (now / EVERY + 1) * EVERY, rows: Vec::new() }
    }

    /// The module's time has begun anew.
    pub fn begin_anew(&mut self, now: Nanos) {
        self.due = (now / EVERY + 1) * EVERY;
    }

    /// When the next row is due.
    pub fn due(&self) -> Nanos {
        self.due
    }

    /// Makes the row that is due.
    pub fn take(&mut self, fleet: &mut Fleet<impl VirtualModule>) {
        let row = self.row(fleet, self.due);
        self.rows.push(row);
        self.due += EVERY;
    }

    /// A row of this moment, which is none of those.
    pub fn look(&self, fleet: &mut Fleet<impl VirtualModule>) -> SampleRow {
        self.row(fleet, fleet.now())
    }

    /// The rows since the last call.
    pub fn rows(&mut self) -> Vec<SampleRow> {
        std::mem::take(&mut self.rows)
    }

    fn row(&self, fleet: &mut Fleet<impl VirtualModule>, at: Nanos) -> SampleRow {
        let mut values = vec![None; self.seen.len()];
        if let Some(module) = fleet.modules_mut().first_mut() {
            let powered = module.board_mut().is_powered();
            let mut looking = Looking(module);
            for ((value, seen), of_firmware) in values.iter_mut().zip(&self.seen).zip(&self.of_firmware) {
                *value = match seen {
                    None => None,
                    Some(_) if *of_firmware && !powered => None,
                    Some(Seen::As(quantity)) => quantity.read(&mut looking).ok(),
                    Some(Seen::Speed(quantity)) => quantity.read(&mut looking).ok().map(|value| self.speed(value)),
                };
            }
        }
        SampleRow { at: at as f64 / MILLISECOND as f64, values }
    }

    /// A velocity of the motion controller in the unit of the product.
    fn speed(&self, velocity: f64) -> f64 {
        match speed_unit(self.product) {
            // Neither divisors, steps nor microsteps make a difference to units of a TMC5160.
            Unit::Pps => {
                let settings = Settings { divisors: (0, 0), microsteps: 256, steps: 200, in_chip: true };
                Live::new(self.product, settings).speed_in_pulses(velocity as i32).round()
            }
            _ => velocity,
        }
    }
}
