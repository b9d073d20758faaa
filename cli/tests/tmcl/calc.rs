//! `tmcl calc`: the tables, and what it says to values that a product cannot have.

use super::harness::{Sim, complaint, run, tmcl};

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

/// A value below 0 needs no `--` before it.
#[test]
fn speeds_and_ways_to_the_left() {
    assert!(calculated("-500 int").starts_with("-500 int as a speed of a TMCM-1140"));
    assert_eq!(calculated("-500 int"), calculated("-- -500 int"));
    assert_eq!(calculated("--product 3212 -1.5 rps"), calculated("--product 3212 -- -1.5 rps"));
    let way = "move -1 turns at 60 rpm with 500 rpm/s";
    assert_eq!(calculated(way), calculated(&format!("-- {way}")));
}

/// The complaint about arguments that are refused.
fn refused(arguments: &str) -> String {
    let words: Vec<&str> = ["calc"].into_iter().chain(arguments.split(' ')).collect();
    let output = run(&words);
    assert_eq!(output.status.code(), Some(2), "{arguments}: {}", complaint(&output));
    assert!(output.stdout.is_empty(), "{arguments}");
    complaint(&output)
}

/// A turn a second is 51200 pps (manual section 6.1.4), and the nearest number at pulse divisor 3 is 1678, which is
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
/// 16e6 / 2^24 = 0.9537 pps and of 256e12 / 2^41 = 116.4 pps2. The numbers next to that are 53687 and 440 of them
/// (TMC5160 datasheet, section 12.1).
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

/// 1.2 A of a full current of 2 A RMS are 153 of 255 and 19.2 of 32 steps: 19 of them are 1.1875 A, which 144 to 151
/// give. A TMCM-6110 has 1.1 A: it cannot have 1.2.
#[test]
fn a_current_in_what_parameters_have() {
    let table = calculated("1.2 A");
    assert!(table.starts_with("1.2 A as a current of a TMCM-1140, whose full current is 2 A RMS\n"), "{table}");
    assert_eq!(line(&table, "A RMS"), ["1.2", "1.1875"]);
    assert_eq!(line(&table, "A peak"), ["1.6971", "1.6794"]);
    assert_eq!(line(&table, "1/255"), ["153", "151", "AP", "6,", "AP", "7,", "AP", "183,", "AP", "200"]);
    assert_eq!(calculated("1200 mA").lines().skip(1).collect::<Vec<_>>(), table.lines().skip(1).collect::<Vec<_>>());
    assert_eq!(line(&calculated("--product 3212 3 A"), "1/255")[..2], ["255", "255"]);
    assert_eq!(refused("--product 6110 1.2 A"), "tmcl: 1.2 A: a current of a TMCM-6110 is at most 1.1 A\n");
    assert_eq!(refused("-1 A"), "tmcl: -1 A: a current is not negative\n");
}

/// A screw with a lead of 4 mm: 10 mm/s are 2.5 turns a second, 128000 pps; a way of 20 mm is five turns.
#[test]
fn millimetres_of_a_lead_screw() {
    let table = calculated("--lead 4 --product 3212 10 mm/s");
    for (unit, wanted) in [("rps", "2.5"), ("pps", "128000"), ("mm/s", "10")] {
        assert_eq!(line(&table, unit)[0], wanted);
    }
    let turns = calculated("move 5 turns at 60 rpm with 500 rpm/s");
    let millimetres = calculated("--lead 4 move 20 mm at 4 mm/s with 500 rpm/s");
    assert_eq!(line(&millimetres, "the whole move")[..3], line(&turns, "the whole move")[..3]);
    assert_eq!(line(&millimetres, "the whole move")[3], "20.0000");
    let unknown =
        "how far a turn of the motor moves the stage is not known; give it in mm with --lead, for example --lead 4";
    assert_eq!(refused("10 mm/s"), format!("tmcl: 10 mm/s: {unknown}\n"));
    assert_eq!(refused("move 20 mm at 60 rpm with 500 rpm/s"), format!("tmcl: 20 mm: {unknown}\n"));
    assert!(refused("--lead 0 10 mm/s").contains("give millimetres above 0"));
}

/// The numbers of a module are what its divisors and its resolution make of them; an option has the last word.
#[test]
fn divisors_of_a_module() {
    let sim = Sim::start(&["--product", "6110", "--tcp", "127.0.0.1:0"]);
    let module = format!("tcp:{}", sim.told("tcp"));
    for line in ["SAP 154, 4, 5", "SAP 153, 4, 9", "SAP 140, 4, 4"] {
        assert!(run(&["send", &module, line]).status.success());
    }
    let link = format!("--link {module} ");
    let by_hand = |rest: &str| calculated(&format!("--product 6110 {rest} 500 int"));
    assert_eq!(
        calculated(&format!("{link}--axis 4 500 int")),
        by_hand("--pulse-divisor 5 --ramp-divisor 9 --microsteps 16")
    );
    assert_eq!(calculated(&format!("{link}500 int")), by_hand(""));
    assert_eq!(
        calculated(&format!("{link}--axis 4 --pulse-divisor 2 500 int")),
        by_hand("--pulse-divisor 2 --ramp-divisor 9 --microsteps 16")
    );
    let output = run(&["calc", "--link", &module, "--axis", "6", "500 int"]);
    assert_eq!(
        (output.status.code(), complaint(&output)),
        (Some(1), "tmcl: axis 6: the module has axes 0 to 5\n".into())
    );
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
    assert!(refused("-5 pps2").contains("an acceleration has no sign"));
    assert!(refused("-5 s").contains("a time is not negative"));
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

/// The unit of speed is 16e6 / (2^3 * 2048 * 32) = 30.517578125 pps, and that of acceleration 256e12 / 2^39 =
/// 465.661287 pps2. So 1000 of each are 30517.578 pps and 465661.287 pps2: v^2 / 2a = 1000 microsteps in 0.065536 s. It
/// slows down by PMUL and PDIV: 0.988 * 1000 / (128 * 2^4) = 247 / 2^9. This is 1024 * 247 / 2^9 * 30.517578125^2 =
/// 460073.35 pps2, 1012.15 microsteps in 0.066332 s (datasheet of the TMC429, section 8.1.10). The other 49187.85
/// microsteps take 1.61179 s.
#[test]
fn the_time_of_a_move() {
    let told = calculated("move 51200 microsteps at 1000 int with 1000 int");
    assert_eq!(
        told,
        "move of a TMCM-1140: pulse divisor 3, ramp divisor 7, 256 microsteps per full step, 200 full steps per turn\n\
         \x20 at 1000 int: 30517.578125 pps by AP 4 = 1000\n\
         \x20 with 1000 int: 465661.287308 pps2 by AP 5 = 1000\n\
         \x20                 microsteps  full steps   turns  seconds\n\
         \x20 speeding up           1000        3.91  0.0195   0.0655\n\
         \x20 at full speed        49188      192.14  0.9607   1.6118\n\
         \x20 slowing down          1012        3.95  0.0198   0.0663\n\
         \x20 the whole move       51200      200.00  1.0000   1.7437\n"
    );
    assert_eq!(calculated("move 1 turn at 1000 int with 1000 int"), told);
    assert_eq!(calculated("move 200 full steps at 1000 int with 1000 int"), told);
    // 400 full steps of 16 microsteps are 6400 microsteps.
    let fine = calculated("--steps 400 --microsteps 16 move 2 turns at 1000 int with 1000 int");
    assert_eq!(line(&fine, "the whole move")[..3], ["12800", "800.00", "2.0000"]);
}

/// On a TMCM-3212 51200 pps2 are 440 * 256e12 / 2^41 = 51222.742 pps2. Half of 12800 microsteps is not enough for 51200
/// pps: sqrt(12800 * 51222.742) = 25605.7 pps, which takes 0.49989 s to get to and as long to slow down from.
#[test]
fn a_short_move_is_a_triangle() {
    let told = calculated("--product 3212 move 12800 microsteps at 51200 pps with 51200 pps2");
    assert_eq!(line(&told, "speeding up"), ["6400", "25.00", "0.1250", "0.4999"]);
    assert_eq!(line(&told, "at full speed"), ["0", "0.00", "0.0000", "0.0000"]);
    assert_eq!(line(&told, "the whole move"), ["12800", "50.00", "0.2500", "0.9998"]);
    // 25605.7 / 51200 * 60 = 30.007 rpm.
    assert!(told.ends_with("\nIt gets to 25606 pps, 30.007 rpm: the way is too short for 51200 pps.\n"), "{told}");
}

/// 0 to 20000 pps with 100000 pps2 are 0.2 s and 2000 microsteps, to 100000 pps with 200000 pps2 0.4 s and 24000. The
/// way back to 20000 pps is as far and as long, and from there with 50000 pps2 it is 0.4 s and 4000 microsteps. What
/// the chip makes of the numbers is within 0.1 % of them.
#[test]
fn a_ramp_of_six_points() {
    let told = calculated(
        "--product 3212 move 204800 microsteps at 100000 pps with 200000 pps2 a1 100000 pps2 v1 20000 pps d1 50000 pps2",
    );
    let number = |name: &str, place: usize| line(&told, name)[place].parse::<f64>().unwrap();
    for (name, way, time) in [
        ("speeding up", 26_000.0, 0.6),
        ("slowing down", 28_000.0, 0.8),
        ("at full speed", 150_800.0, 1.508),
        ("the whole move", 204_800.0, 2.908),
    ] {
        assert!((number(name, 0) / way - 1.0).abs() < 2e-3, "{name}: {told}");
        assert!((number(name, 3) / time - 1.0).abs() < 2e-3, "{name}: {told}");
    }
    assert!(told.contains("  v1 20000 pps: ") && told.contains(" pps by AP 16 = 20000\n"), "{told}");
    // With half of the deceleration, from where it gives way to D1: 48000 and 4000 microsteps.
    let told = calculated(
        "--product 3212 move 204800 microsteps at 100000 pps with 200000 pps2 dmax 100000 pps2 a1 100000 pps2 v1 20000 pps \
         d1 50000 pps2",
    );
    let slowing = line(&told, "slowing down")[0].parse::<f64>().unwrap();
    assert!((slowing / 52_000.0 - 1.0).abs() < 2e-3, "{told}");
}

/// 1000 of a TMCM-1140 are 30517.578 pps, and 100 are 46566.129 pps2: v^2 / 2a = 10000 microsteps in 0.65536 s.
#[test]
fn the_way_of_a_stop() {
    let told = calculated("stop from 1000 int with 100 int");
    assert_eq!(line(&told, "until it stands"), ["10000", "39.06", "0.1953", "0.6554"]);
    assert!(told.contains("  from 1000 int: 30517.578125 pps by ROR 0, 1000\n"), "{told}");
}

/// A folder with a program, and what a run of it says.
fn ran(product: &str, program: &str) -> serde_json::Value {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("program.tmc"), program).unwrap();
    let options = ["run", "program.tmc", "--json", "--product", product, "--until", "60 s"];
    let output = tmcl(&options).current_dir(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", complaint(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Moves of virtual modules take as long as it says, within 1 %.
#[test]
fn a_virtual_module_takes_as_long() {
    for (product, options, way, parameters) in [
        ("1140", "at 1000 int with 1000 int", 51_200, "SAP 4, 0, 1000\nSAP 5, 0, 1000"),
        // A triangle.
        ("1140", "at 2047 int with 20 int", 102_400, "SAP 4, 0, 2047\nSAP 5, 0, 20"),
        // So small an acceleration gets another one in its place.
        ("1140", "at 500 int with 1 int", 200_000, "SAP 4, 0, 500\nSAP 5, 0, 1"),
        ("6110", "at 300 int with 50 int", 60_000, "SAP 4, 0, 300\nSAP 5, 0, 50"),
        ("3212", "at 60 rpm with 30 rpm/s", 153_600, "SAP 4, 0, 51200\nSAP 5, 0, 25600\nSAP 17, 0, 25600"),
        ("3212", "at 500000 pps with 100000 pps2", 100_000, "SAP 4, 0, 500000\nSAP 5, 0, 100000\nSAP 17, 0, 100000"),
        (
            "3212",
            "at 100000 pps with 200000 pps2 a1 100000 pps2 v1 20000 pps dmax 150000 pps2 d1 50000 pps2 vstart 1000 pps vstop \
             1000 pps",
            204_800,
            "SAP 4, 0, 100000\nSAP 5, 0, 200000\nSAP 15, 0, 100000\nSAP 16, 0, 20000\nSAP 17, 0, 150000\nSAP 18, 0, 50000\n\
             SAP 19, 0, 1000\nSAP 20, 0, 1000",
        ),
    ] {
        let told = calculated(&format!("--product {product} move {way} microsteps {options}"));
        let told = line(&told, "the whole move")[3].parse::<f64>().unwrap();
        let run = ran(product, &format!("{parameters}\nMVP ABS, 0, {way}\nWAIT POS, 0, 0\nSTOP\n"));
        let took = run["time_s"].as_f64().unwrap();
        assert_eq!(run["axes"][0]["position"], way, "{run}");
        assert!((took / told - 1.0).abs() < 0.01, "{product} {options}: {told} s, in truth {took} s");
    }
    for (product, options, program) in [
        ("1140", "stop from 1000 int with 50 int", "SAP 5, 0, 50\nROR 0, 1000"),
        ("3212", "stop from 60 rpm with 60 rpm/s", "SAP 5, 0, 51200\nROR 0, 51200"),
    ] {
        let told = calculated(&format!("--product {product} {options}"));
        let told = line(&told, "until it stands")[0].parse::<f64>().unwrap();
        let stop = "WAIT TICKS, 0, 500\nGAP 1, 0\nAGP 0, 2\nMST 0\nWAIT TICKS, 0, 500\nGAP 1, 0\nAGP 1, 2\nSTOP\n";
        let run = ran(product, &format!("{program}\n{stop}"));
        let variable = |number: &str| run["user_variables"][number].as_f64().unwrap();
        let went = variable("1") - variable("0");
        assert!((went / told - 1.0).abs() < 0.01, "{product} {options}: {told} microsteps, in truth {went}");
    }
}

#[test]
fn a_move_that_cannot_be_is_refused_with_an_example() {
    assert!(
        refused("move at 60 rpm with 60 rpm/s").contains("a move needs a distance, for example: tmcl calc move 51200")
    );
    assert!(
        refused("move 5 at 60 rpm with 60 rpm/s").contains("'5' has no unit. Write one behind it: microsteps, full")
    );
    assert!(refused("move 5 turn with 60 rpm/s").contains("'at' and a value are missing; write for example"));
    assert!(refused("move 5 turns at 60 rpm").contains("'with' and a value are missing"));
    assert!(refused("move 5 turns at 0 rpm with 60 rpm/s").contains("0 rpm: behind 'at' a speed above 0 is needed"));
    assert!(
        refused("move 5 turns at 60 rpm/s with 60 rpm/s").contains("behind 'at' a speed is needed, such as 60 rpm")
    );
    assert!(refused("move 5 turns at fast with 60 rpm/s").contains("behind 'at': 'fast' is no number"));
    assert!(refused("move 5 turns at 60 rpm at 60 rpm with 60 rpm/s").contains("'at' can be given only once"));
    assert!(refused("move 0 turns at 60 rpm with 60 rpm/s").contains("0 turns: that is no way at all"));
    assert!(refused("move 100000 turns at 60 rpm with 60 rpm/s").contains("no position is 5120000000 microsteps away"));
    assert!(refused("move 5 trns at 60 rpm with 60 rpm/s").contains("did you mean 'turns'?"));
    assert!(refused("move 5 turns at 100 rpm with 60 rpm/s").contains("at most 73.206425 rpm"));
    assert!(
        refused("move 5 turns at 60 rpm with 60 rpm/s v1 5 rpm").contains("the ramp of a TMCM-1140 has no such point")
    );
    let lonely = refused("--product 3212 move 5 turns at 60 rpm with 60 rpm/s v1 5 rpm");
    assert!(lonely.contains("give v1, a1 and d1 together"), "{lonely}");
    assert!(refused("stop 5 turns from 60 rpm with 60 rpm/s").contains("a stop has no way of its own"));
    assert!(refused("stop at 60 rpm with 60 rpm/s").contains("'from' and a value are missing"));
}
