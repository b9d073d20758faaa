//! The end of program memory, which has another size on another product. Its last address can be loaded, read, started,
//! jumped to, called and waited at, and may be a vector. The address behind it is refused, or ends the program.

use common::program::{STOPPED, command};
use common::{Bench, INVALID_VALUE, OK};
use hal_sim::clock::MILLISECOND;
use tmcm_sim::Product;

/// Number of commands that the manuals give: section 3.3 of that of the TMCM-1140, 1 of that of the TMCM-3212; for the
/// others the number that is quoted.
fn size(product: Product) -> i32 {
    if product == Product::Tmcm3212 { 6144 } else { 2048 }
}

#[test]
fn nothing_is_loaded_behind_the_last_address() {
    for product in Product::ALL {
        let (mut bench, size) = (Bench::of(product), size(product));
        let last = size - 1;
        bench.refused(&format!("132, 0, 0, {size}"), INVALID_VALUE);
        bench.refused("132, 0, 0, -1", INVALID_VALUE);
        bench.ok(&format!("132, 0, 0, {last}"));
        assert_eq!(bench.ask("SGP 1, 2, 7").0, 101);
        assert_eq!(bench.memory_status().pointer, size);
        bench.refused("SGP 1, 2, 8", INVALID_VALUE);
        bench.ok("133, 0, 0, 0");
        bench.power_cycle();
        assert_eq!((bench.memory(last), bench.memory(0)), (command("SGP 1, 2, 7"), command("0, 0, 0, 0")));
        assert_eq!(bench.ask(&format!("134, 0, 0, {size}")).0, INVALID_VALUE);
    }
}

#[test]
fn a_program_gets_to_the_last_address_by_every_way() {
    for product in Product::ALL {
        let last = size(product) - 1;
        let mut bench = Bench::of(product);
        bench.download(last, &["SGP 1, 2, 7"]);
        bench.refused(&format!("129, 1, 0, {}", last + 1), INVALID_VALUE);
        // Behind the last command the program has run off its end.
        bench.run_to_end(last);
        assert_eq!((bench.variable(1), bench.mode(), bench.program_counter()), (7, STOPPED, 0));
        for way in ["JA", "JC ZE,"] {
            bench.ok("SGP 1, 2, 0");
            bench.download(0, &["CALC LOAD, 0", &format!("{way} {last}"), "SGP 1, 2, 1"]);
            bench.run_to_end(0);
            assert_eq!(bench.variable(1), 7, "{way}");
        }
        bench.download(last, &["RSUB"]);
        bench.download(0, &[&format!("CSUB {last}"), "SGP 2, 2, 8", "STOP"]);
        bench.run_to_end(0);
        assert_eq!(bench.variable(2), 8);
        bench.download(last, &["WAIT TICKS, 0, 10"]);
        bench.start(last);
        bench.run(90 * MILLISECOND);
        assert_eq!(bench.program_counter(), last);
        bench.run(20 * MILLISECOND);
        assert_eq!((bench.mode(), bench.program_counter()), (STOPPED, 0));
    }
}

#[test]
fn a_handler_may_be_at_the_end_of_memory() {
    for product in Product::ALL {
        let last = size(product) - 1;
        let mut bench = Bench::of(product);
        bench.refused(&format!("VECT 0, {}", last + 1), INVALID_VALUE);
        assert_eq!(bench.ask(&format!("VECT 0, {last}")).0, OK);
        bench.download(last - 1, &["SGP 3, 2, 9", "RETI"]);
        let vector = format!("VECT 0, {}", last - 1);
        bench.download(0, &[&vector, "SGP 0, 3, 5", "EI 0", "EI 255", "WAIT TICKS, 0, 3", "SGP 4, 2, 1", "STOP"]);
        bench.run_to_end(0);
        assert_eq!((bench.variable(3), bench.variable(4)), (9, 1));
    }
}

#[test]
fn an_address_behind_the_last_one_ends_the_program() {
    for product in Product::ALL {
        let size = size(product);
        for way in ["JA", "JC ZE,", "CSUB", "VECT 0,"] {
            for address in [size, size + 1, 65_536, -1] {
                let mut bench = Bench::of(product);
                bench.download(0, &["CALC LOAD, 0", "SGP 1, 2, 1", &format!("{way} {address}"), "SGP 1, 2, 2"]);
                bench.run_to_end(0);
                assert_eq!((bench.variable(1), bench.program_counter()), (1, 0), "{way} {address}");
            }
        }
    }
}
