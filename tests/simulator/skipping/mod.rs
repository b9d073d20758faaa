//! A virtual module that leaves out polls of its firmware is the same as one that polls each millisecond. This holds
//! for what it replies and when, what its chips get and what its motors do.

mod programs;
mod ratios;
mod sessions;
mod turns;
