//! Time under the control of a fleet's owner. It passes on behalf of outstanding requests and no further, commands are
//! carried out at their times, and nothing depends on how the owner slices time.

mod buses;
mod images;
mod paused;
mod peek;
mod power_cuts;
mod rig;
mod slices;
