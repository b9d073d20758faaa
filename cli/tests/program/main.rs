//! The program `tmcl` as its users meet it: real processes, pseudo terminals and sockets.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod addresses;
mod asks;
mod asm;
mod bad_input;
#[path = "../../../tests/common/image.rs"]
mod build;
mod calc;
mod canopen;
mod colours;
mod connections;
mod control;
mod debug;
mod dump;
mod eds;
mod eeprom;
mod ending;
mod fake;
mod foreign_text;
mod greeting;
mod harness;
mod help;
mod image;
mod image_canopen;
mod image_hosts;
mod image_sisters;
mod link_faults;
mod links;
mod load;
mod messages;
mod monitor;
mod page;
mod params;
mod ports;
mod products;
mod programs;
mod pty;
mod readme;
mod run;
mod scan;
mod scenarios;
mod send;
mod shell;
mod sim_products;
mod sim_worlds;
mod starts;
mod telegrams;
mod time;
mod time_hosts;
mod tmcm3212;
mod tune;
mod tune_limits;
mod tune_shown;
mod turns;
mod world;
