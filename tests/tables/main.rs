//! The parameters, one by one and as a whole: ranges, defaults and effects; and the files of `docs` that list them and
//! the emergencies of the CANopen firmware.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod emergency_docs;
mod live_values;
mod parameter_docs;
mod parameters;
mod rules;
mod torque_curve;
