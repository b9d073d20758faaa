//! Interrupt parameters, bank 3 (manual section 5.4), in the manual's order.

use super::{ANY, Access, Row, Storage, Unit, parameters};

/// Which edges of a signal count.
const EDGES: &[(i32, i32)] = &[(0, 3)];

parameters! {
    /// Interrupt configuration, bank 3 (manual section 5.4).
    InterruptParameter;
    0 Timer0 "timer 0 period" Milliseconds ANY, ReadWrite Volatile 0 "unsigned 32 bits",
    1 Timer1 "timer 1 period" Milliseconds ANY, ReadWrite Volatile 0 "unsigned 32 bits",
    2 Timer2 "timer 2 period" Milliseconds ANY, ReadWrite Volatile 0 "unsigned 32 bits",
    27 StopLeft0 "stop left 0 transition" Choice EDGES, ReadWrite Volatile 0 "0 off, 1 low-high, 2 high-low, 3 both",
    28 StopRight0 "stop right 0 transition" Choice EDGES, ReadWrite Volatile 0 "0 off, 1 low-high, 2 high-low, 3 both",
    39 Input0 "input 0 transition" Choice EDGES, ReadWrite Volatile 0 "0 off, 1 low-high, 2 high-low, 3 both",
    40 Input1 "input 1 transition" Choice EDGES, ReadWrite Volatile 0 "0 off, 1 low-high, 2 high-low, 3 both",
    41 Input2 "input 2 transition" Choice EDGES, ReadWrite Volatile 0 "0 off, 1 low-high, 2 high-low, 3 both",
    42 Input3 "input 3 transition" Choice EDGES, ReadWrite Volatile 0 "0 off, 1 low-high, 2 high-low, 3 both",
}
