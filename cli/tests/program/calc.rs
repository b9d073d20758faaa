//! `tmcl calc`: the tables, and what it says to values that a product cannot have.

use super::harness::{complaint, run};

/// The tables for these arguments.
fn calculated(arguments: &str) -> String {
    let words: Vec<&str> = ["calc"].into_iter().chain(arguments.split(' ')).collect();
    let output = run(&words);
    assert!(output.status.success() && output.stderr.is_empty(), "{arguments}: {}", complaint(&output));
    String::from_utf8(output.stdout).unwrap()
}

/// The words of the line for a unit, without the unit.
fn line<'a>(table: &'a str, unit: &str) -> Vec<&'a str> {
    let line = table.lines().find_map(|line| line.trim_start().strip_prefix(unit)?.strip_prefix(' '));
    line.unwrap_or_else(|| panic!("no '{unit}' in:\n{table}")).split_whitespace().collect()
}

/// What it says to arguments that it refuses.
fn refused(arguments: &str) -> String {
    let words: Vec<&str> = ["calc"].into_iter().chain(arguments.split(' ')).collect();
    let output = run(&words);
    assert_eq!(output.status.code(), Some(2), "{arguments}: {}", complaint(&output));
    assert!(output.stdout.is_empty(), "{arguments}");
    complaint(&output)
}

/// One turn a second is 51200 pps (manual section 6.1.4), and the nearest number at pulse divisor 3 is 1678, which is
/// 51208.5 pps (section 6.1.1).
#[test]
fn a_speed_in_all_units() {
    assert_eq!(
        calculated("60 rpm"),
        "60 rpm as a speed of a TMCM-1140: pulse divisor 3, 256 microsteps per full step, 200 full steps per turn\n\
         \x20                   wanted          gets\n\
         \x20 int            1677.7216   1678         write 1678\n\
         \x20 pps           51200       51208.496094\n\
         \x20 full steps/s    200         200.033188\n\
         \x20 rps               1           1.000166\n\
         \x20 rpm              60          60.009956\n"
    );
}

/// Section 6.1.2 of the manual: 100 at ramp divisor 7 and pulse divisor 3 is 46566 pps2. The same number as a speed is
/// 100
/// * 16e6 / (8 * 65536) = 3051.8 pps.
#[test]
fn a_number_is_a_speed_or_an_acceleration() {
    let both = calculated("--product 6110 100 int");
    let (speed, acceleration) = both.split_once("100 int as an acceleration of a TMCM-6110").unwrap();
    assert_eq!(line(speed, "pps"), ["3051.757813", "3051.757813"]);
    assert_eq!(line(acceleration, "pps2"), ["46566.128731", "46566.128731"]);
    // With what only one of them can be, that one is enough.
    let backwards = calculated("-- -100 int");
    assert_eq!(line(&backwards, "pps"), ["-3051.757813", "-3051.757813"]);
    assert!(!backwards.contains("acceleration"), "{backwards}");
}

#[test]
fn options_describe_the_axis() {
    // 16e6 / (2^5 * 65536) = 7.629395 pps are one unit; 16 microsteps of 400 full steps are a turn.
    let speed = calculated("--product 3110 --pulse-divisor 5 --microsteps 16 --steps 400 1000 pps");
    assert_eq!(line(&speed, "int"), ["131.072", "131", "write", "131"]);
    assert_eq!(line(&speed, "full steps/s"), ["62.5", "62.465668"]);
    assert_eq!(line(&speed, "rps"), ["0.15625", "0.156164"]);
    // 256e12 / 2^(9 + 0 + 29) = 931.322575 pps2 are one unit.
    let acceleration = calculated("--ramp-divisor 9 --pulse-divisor 0 1 rps/s");
    assert_eq!(line(&acceleration, "int"), ["54.975581", "55", "write", "55"]);
    assert_eq!(line(&acceleration, "pps2"), ["51200", "51222.741604"]);
}

/// On a TMCM-3212 60 rpm are written as 51200 pps, and 60 rpm a second as 51200 pps2. The chip has whole numbers of
/// 16e6 / 2^24 = 0.9537 pps and of 256e12 / 2^41 = 116.4 pps2: 53687 and 440 of them are next to that (TMC5160
/// datasheet, section 12.1).
#[test]
fn a_product_with_pps() {
    assert_eq!(
        calculated("--product 3212 60 rpm 60 rpm/s"),
        "60 rpm as a speed of a TMCM-3212: 256 microsteps per full step, 200 full steps per turn\n\
         \x20                   wanted          gets\n\
         \x20 chip          53687.0912  53687         write 53687 while AP 255 is 0\n\
         \x20 pps           51200       51199.913025  write 51200\n\
         \x20 full steps/s    200         199.999660\n\
         \x20 rps               1           0.999998\n\
         \x20 rpm              60          59.999898\n\
         60 rpm/s as an acceleration of a TMCM-3212: 256 microsteps per full step, 200 full steps per turn\n\
         \x20                      wanted          gets\n\
         \x20 chip             439.804651    440         write 440 while AP 255 is 0\n\
         \x20 pps2           51200         51222.741604  write 51200\n\
         \x20 full steps/s2    200           200.088834\n\
         \x20 rps/s              1             1.000444\n\
         \x20 rpm/s             60            60.026650\n"
    );
    // 31250 * 512 / 16e6 = 1 s; 3 * 2^18 / 16e6 = 0.049152 s.
    assert_eq!(line(&calculated("--product 3212 31250 x32 us"), "s"), ["1"]);
    let step = calculated("--product 3212 3 x16.384 ms");
    assert_eq!((line(&step, "s"), line(&step, "x32 us")), (vec!["0.049152"], vec!["1536", "1536", "AP", "21"]));
    assert!(
        refused("--product 3212 5 int")
            .contains("a TMCM-3212 has no unit 'int'; its units are chip, pps, full steps/s")
    );
    let ending = "--pulse-divisor: a TMCM-3212 has no such divisor\n";
    assert!(refused("--product 3212 --pulse-divisor 3 60 rpm").ends_with(ending));
    // The limits of its parameters 4 and 5 (manual, table 1): 7999774 / 51200 * 60 = 9374.7 rpm.
    assert!(refused("--product 3212 9375 rpm").contains("at most 9374.735156 rpm (7999774 pps)"));
    assert!(refused("--product 3212 7629279 pps2").contains("at most 7629278 pps2"));
}

/// WAIT and parameters 204 and 214 count in 10 ms (manual section 3.7.22, chapter 4).
#[test]
fn a_time_in_what_counts_it() {
    let time = calculated("1.5 s");
    assert_eq!(line(&time, "x10 ms"), ["150", "150", "AP", "204,", "AP", "214,", "WAIT"]);
    assert_eq!(line(&time, "ms")[..2], ["1500", "1500"]);
    // Half a unit is rounded up, less is no time at all.
    assert_eq!(line(&calculated("5 ms"), "x10 ms")[..2], ["0.5", "1"]);
    assert_eq!(line(&calculated("4999 us"), "x10 ms"), ["0.4999"]);
    // The other way round.
    assert_eq!(line(&calculated("200 x10 ms"), "s"), ["2"]);
    // What takes no such number is not named: parameter 214 begins with 1, both end with 65535.
    assert_eq!(line(&calculated("0 s"), "x10 ms"), ["0", "0", "AP", "204,", "WAIT"]);
    assert_eq!(line(&calculated("656 s"), "x10 ms"), ["65600", "65600", "WAIT"]);
}

#[test]
fn values_in_many_forms() {
    let expected = calculated("60 rpm");
    for form in ["60rpm", "60 RPM", "+60. rpm", "60 turns/min"] {
        let words = calculated(form);
        assert_eq!(words.split_once(" as ").unwrap().1, expected.split_once(" as ").unwrap().1, "{form}");
    }
    assert_eq!(calculated("60 rpm 1 s"), format!("{expected}{}", calculated("1 s")));
    assert_eq!(calculated("60 rpm, 1 s"), calculated("60rpm 1s"));
    let accelerations = ["1 full steps/s^2", "1 fullsteps/s²", "1 fs/s2"].map(calculated);
    assert_eq!(accelerations[0], accelerations[1]);
    assert_eq!(accelerations[0], accelerations[2]);
}

#[test]
fn what_no_module_can_have_is_refused_with_a_way_out() {
    // 2047 * 30.517578125 * 60 / 51200 = 73.206425 rpm at pulse divisor 3; half of 100 rpm is less, at 2 it is twice
    // that.
    let fast = refused("100 rpm");
    assert!(fast.contains("at most 73.206425 rpm (2047 int). It is possible with --pulse-divisor 2\n"), "{fast}");
    // At pulse divisor 0 it is eight times that.
    assert!(refused("600 rpm").ends_with("at most 73.206425 rpm (2047 int)\n"));
    assert!(refused("2048 int").ends_with("2048 int: a speed of a TMCM-1140 is at most 2047 int\n"));
    // At pulse divisor 7 a unit is 30.517578125 / 2^(7 - 3) = 1.907 pps, of which 1 pps is more than half.
    let slow = refused("1 pps");
    assert!(slow.contains("0 or at least 30.517578 pps (1 int). It is possible with --pulse-divisor 7\n"), "{slow}");
    // 2047 * 256e12 / 2^39 = 953208.655 pps2; three ramp divisors less are eight times that.
    let hard = refused("5000000 pps2");
    assert!(hard.contains("at most 953208.655119 pps2 (2047 int). It is possible with --ramp-divisor 4\n"), "{hard}");
    assert!(refused("-- -5 pps2").contains("an acceleration has no sign"));
    assert!(refused("-- -5 s").contains("a time is not negative"));
}

#[test]
fn what_is_no_value_is_refused_with_an_example() {
    assert!(refused("60").contains("'60' has no unit. Write one behind it: int, chip, pps,"));
    assert!(refused("60 rpn").contains("did you mean 'rpm'?"));
    assert!(refused("fast").contains("Write a number and its unit, for example '60 rpm'"));
    assert!(refused("1.2.3 rpm").contains("'1.2.3' is no number"));
    assert!(refused("1234567890123456 rpm").contains("at most 15 digits"));
    assert!(
        refused("5 chip").contains("a TMCM-1140 has no unit 'chip'; its units are int, pps, full steps/s, rps, rpm")
    );
    assert!(refused("5 rpm --product 1141").contains("did you mean '1140'?"));
    assert!(refused("5 rpm --microsteps 3").contains("1, 2, 4, 8, 16, 32, 64, 128 or 256"));
    assert!(refused("5 rpm --steps 0").contains("1..=65535"));
    assert!(refused("5 rpm --pulse-divisor 14").contains("0..=13"));
    refused("--product 1140");
}
