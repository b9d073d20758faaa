//! The behaviour of an axis at the limits of its rules: to the poll, the microstep and the datagram.

mod bare;
mod current;
mod moves;
mod plans;
mod search;
mod tmc5160;
