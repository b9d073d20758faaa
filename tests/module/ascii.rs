//! ASCII mode (manual section 3.4), typed at a virtual module in virtual time.

use common::{Bench, random_inputs, telegram};
use hal_sim::clock::MILLISECOND;
use tmcm::module::Source;
use tmcm::tmcl::{Command, Instruction, binary, text};
use tmcm_sim::client::Client;
use tmcm_sim::{Product, VirtualModule};

/// Longest time a reply takes: some EEPROM pages.
const PATIENCE_MS: u64 = 200;

/// Somebody at a terminal.
#[derive(Clone, Copy)]
struct Terminal {
    source: Source,
    client: Client,
}

const USB: Terminal = Terminal { source: Source::Usb, client: Client(0) };
const RS485: Terminal = Terminal { source: Source::Rs485, client: Client(0) };

/// Returns what reaches a terminal in so many milliseconds, escaped; nobody else is to hear anything.
fn hear(bench: &mut Bench, terminal: Terminal, milliseconds: u64) -> String {
    bench.run(milliseconds * MILLISECOND);
    let mut bytes = Vec::new();
    while let Some(sent) = bench.module.sent() {
        assert_eq!((sent.source, sent.client), (terminal.source, terminal.client));
        bytes.extend(sent.bytes);
    }
    bytes.escape_ascii().to_string()
}

/// Types text all at once and gives what comes back.
fn say(bench: &mut Bench, terminal: Terminal, text: &[u8]) -> String {
    bench.module.hear(terminal.source, terminal.client, text);
    hear(bench, terminal, PATIENCE_MS)
}

/// A TMCM-1140 whose USB link is in ASCII mode with this echo.
fn entered(echo: u8) -> Bench {
    entered_on(Product::Tmcm1140, echo)
}

/// The same with any product.
fn entered_on(product: Product, echo: u8) -> Bench {
    let mut bench = Bench::of(product);
    bench.ok(&format!("SGP 67, 0, {echo}"));
    assert_eq!(bench.ok("139"), 0);
    bench
}

/// Sends a line without an echo and gives status and value.
fn ask(bench: &mut Bench, line: &str) -> (u8, i32) {
    let reply = say(bench, USB, format!("{line}\r").as_bytes());
    let numbers = reply.strip_prefix("BA ").and_then(|rest| rest.strip_suffix("\\r"));
    let numbers = numbers.and_then(|numbers| numbers.split_once(' '));
    let (status, value) = numbers.unwrap_or_else(|| panic!("{line}: {reply}"));
    (status.parse().unwrap(), value.parse().unwrap())
}

#[test]
fn each_character_is_echoed_once_the_module_is_addressed() {
    let mut bench = entered(0);
    // The stray CR that terminals send after the telegram.
    assert_eq!(say(&mut bench, USB, b"\r"), "");
    for (typed, echo) in [(b"A", "A"), (b" ", " "), (b"g", "g"), (b"X", "X"), (b"\x08", "\\x08 \\x08"), (b"a", "a")] {
        assert_eq!(say(&mut bench, USB, typed), echo);
    }
    assert_eq!(say(&mut bench, USB, b"p 4, 0\r"), "p 4, 0\\rBA 100 1000\\r");
    assert_eq!(say(&mut bench, USB, b"AGAP 5, 0\x7F0\r"), "AGAP 5, 0\\x08 \\x080\\rBA 100 1000\\r");
    assert_eq!(say(&mut bench, USB, b"BGAP 5, 0\rB\x08\x08\x08\r\n"), "");
    assert_eq!(say(&mut bench, USB, b"BX\x08\x08AMST\r\n"), "AMST\\rBA 100 0\\r");
    assert_eq!(say(&mut bench, USB, b"A\x08BMST\r"), "A\\x08 \\x08");
}

#[test]
fn the_line_is_echoed_as_it_was_edited() {
    let mut bench = entered(16);
    assert_eq!(say(&mut bench, USB, b"\rAGAP 4, X\x080"), "");
    assert_eq!(say(&mut bench, USB, b"\r"), "AGAP 4, 0\\rBA 100 1000\\r");
    assert_eq!(say(&mut bench, USB, b"CGAP 4, 0\rAFOO\r"), "AFOO\\rBA 2 0\\r");
}

#[test]
fn the_reply_alone() {
    for bits in [32, 48] {
        let mut bench = entered(bits);
        assert_eq!(say(&mut bench, USB, b"\rAGAP 4, X\x080\rBMST\rAFOO\r"), "BA 100 1000\\rBA 2 0\\r");
    }
}

#[test]
fn the_echo_changes_at_once() {
    let mut bench = entered(0);
    assert_eq!(say(&mut bench, USB, b"ASGP 67, 0, 33\r"), "ASGP 67, 0, 33\\rBA 100 33\\r");
    assert_eq!(say(&mut bench, USB, b"AGGP 67, 0\r"), "BA 100 33\\r");
    assert_eq!(say(&mut bench, USB, b"ASGP 67, 0, 16\rAMST\r"), "BA 100 16\\rAMST\\rBA 100 0\\r");
    // From another link, in the midst of a line.
    assert_eq!(say(&mut bench, RS485, &telegram("139")), "\\x02\\x01d\\x8b\\x00\\x00\\x00\\x00\\xf2");
    assert_eq!(say(&mut bench, RS485, b"ASGP 67, 0, "), "");
    assert_eq!(say(&mut bench, USB, b"ASGP 67, 0, 0\r"), "ASGP 67, 0, 0\\rBA 100 0\\r");
    assert_eq!(say(&mut bench, RS485, b"32\r"), "32\\rBA 100 32\\r");
}

/// Every command that the manual lists, and its examples.
#[test]
fn every_listed_command_works() {
    const LISTED: &str = "ROL ROR MST MVP SAP GAP STAP RSAP SGP GGP STGP RSGP RFS SIO GIO SCO GCO CCO \
                          UF0 UF1 UF2 UF3 UF4 UF5 UF6 UF7";
    let mut table: Vec<&str> = Instruction::all().filter(|i| i.ascii).map(|i| i.mnemonic).collect();
    let mut listed: Vec<&str> = LISTED.split(' ').collect();
    table.sort_unstable();
    listed.sort_unstable();
    assert_eq!(table, listed);

    let mut bench = entered(32);
    for (line, status, value) in [
        ("AROL 0, 500", 100, 500),
        ("A ROR 0, $1F4", 100, 500),
        ("A MST 0", 100, 0),
        ("AMST", 100, 0),
        ("AMVP ABS, 0, 50000", 100, 50_000),
        ("A MVP 0, 0, 0x1000", 100, 4096),
        ("ASCO 1, 0, -5000", 100, -5000),
        ("aMVP coord, 0, 1", 100, -5000),
        ("AMVP COORD,255,1", 100, -5000),
        ("A\tMST\t0 ", 100, 0),
        ("ASAP, 4, 0, 996", 100, 996),
        ("AGAP 4, 0", 100, 996),
        ("agap 4", 100, 996),
        ("ASTAP 4, 0", 100, 0),
        ("ASTAP 4, 0, 0", 100, 0),
        ("ARSAP 4, 0, 0", 100, 0),
        ("ASTGP 42, 2, 0", 100, 0),
        ("ARSGP 42, 2, 0", 100, 0),
        ("AGCO 2, 0, 0", 100, 0),
        ("AGCO 2, 0, 1", 4, 0),
        ("ASAP 4, 0, 7", 100, 7),
        ("ARSAP 4, 0", 100, 0),
        ("AGAP 4, 0", 100, 996),
        ("ASGP 5, 2, -77", 100, -77),
        ("ASTGP 5, 2", 100, 0),
        ("ASGP 5, 2, 1", 100, 1),
        ("ARSGP 5, 2", 100, 0),
        ("AGGP 5, 2", 100, -77),
        ("ARFS STOP, 0", 100, 0),
        ("ARFS STATUS, 0", 100, 0),
        ("ASIO 0, 2, 1", 100, 1),
        ("AGIO 0, 2", 100, 1),
        ("AGCO 1, 0", 100, -5000),
        ("ASCO 1, 255, 0", 100, 0),
        ("AGCO 1, 255", 100, 0),
        ("AUF0 1, 0, 2", 6, 2),
        ("AUF7 1, 0, 2", 6, 2),
        ("AUF0", 6, 0),
        ("AUF1 1", 6, 0),
        ("ARUN", 100, 0),
        ("ASTOP", 100, 0),
    ] {
        assert_eq!(ask(&mut bench, line), (status, value), "{line}");
    }
    let (status, captured) = ask(&mut bench, "ACCO 2, 0");
    assert_eq!((status, captured), (100, ask(&mut bench, "AGAP 1, 0").1));
}

/// The lines of the TMCM-6110's manual, section 5.5, and the same commands for each of its axes; the TMCM-3110 has
/// three.
#[test]
fn lines_name_their_axis() {
    for product in [Product::Tmcm3110, Product::Tmcm6110] {
        let mut bench = entered_on(product, 32);
        let axes = product.spec().axes;
        for (line, value) in [
            ("AMVP ABS, 1, 50000", 50_000),
            ("A MVP ABS, 1, 50000", 50_000),
            ("AROL 2, 500", 500),
            ("A MST 1", 0),
            ("A MST 2", 0),
        ] {
            assert_eq!(ask(&mut bench, line), (100, value), "{line}");
        }
        for axis in 0..axes {
            let place = -5000 - i32::from(axis);
            for (line, value) in [
                (format!("AROR {axis}, 500"), 500),
                (format!("ARFS STOP, {axis}"), 0),
                (format!("AMST {axis}"), 0),
                (format!("AMVP ABS, {axis}, {place}"), place),
                (format!("AGAP 0, {axis}"), place),
                (format!("ASAP 4, {axis}, 800"), 800),
                (format!("ASTAP 4, {axis}"), 0),
                (format!("ARSAP 4, {axis}"), 0),
                (format!("ASCO 3, {axis}, {place}"), place),
                (format!("AGCO 3, {axis}"), place),
                (format!("AMVP COORD, {axis}, 3"), place),
            ] {
                assert_eq!(ask(&mut bench, &line), (100, value), "{line}");
            }
        }
        bench.run(3000 * MILLISECOND);
        for axis in 0..axes {
            let place = -5000 - i32::from(axis);
            assert_eq!(say(&mut bench, USB, format!("AGAP 1, {axis}\r").as_bytes()), format!("BA 100 {place}\\r"));
            assert_eq!(ask(&mut bench, &format!("ACCO 4, {axis}")), (100, place));
        }
        for line in [format!("AROL {axes}, 500"), format!("AGAP 1, {axes}"), format!("AMVP ABS, {axes}, 5")] {
            assert_eq!(ask(&mut bench, &line).0, 4, "{line}");
        }
        for (output, line) in (0..8).map(|n| (n, format!("ASIO {n}, 2, 1"))) {
            assert_eq!(ask(&mut bench, &line), (100, 1), "{line}");
            assert_eq!(ask(&mut bench, &format!("AGIO {output}, 2")), (100, 1));
            assert_eq!(ask(&mut bench, &format!("AGIO {output}, 0")), (100, 0));
        }
        // BIN leads back to telegrams.
        assert_eq!(say(&mut bench, USB, b"ABIN\r"), "BA 100 0\\r");
        assert_eq!(bench.ok("GAP 4, 2"), 800);
    }
}

#[test]
fn errors_have_a_status() {
    let mut bench = entered(32);
    for (line, status, value) in [
        ("A", 2, 0),
        ("AFOO 1, 2", 2, 0),
        ("A6, 1, 0", 2, 0),
        ("A136, 1", 2, 0),
        ("ABIN 1", 2, 0),
        ("ACALC ADD, 1", 6, 0),
        ("AWAIT", 6, 0),
        ("AEI 3", 6, 0),
        ("AGAP", 3, 0),
        ("AGAP speed, 0", 3, 0),
        ("AMVP UP, 0, 1", 3, 0),
        ("AGAP 255, 0", 3, 0),
        ("AGAP 1, 1", 4, 0),
        ("AGAP 1, 0, 0", 4, 0),
        ("AROL 2, 500", 4, 500),
        ("ASAP 4, 0", 4, 0),
        ("ASAP 4, 0, 3000", 4, 3000),
        ("ASAP 4, 0, $+10", 4, 0),
        ("ASAP 4, 0, 0x-10", 4, 0),
        ("AGGP 0, 7", 4, 0),
        ("AGAP 4, 0", 100, 1000),
    ] {
        assert_eq!(ask(&mut bench, line), (status, value), "{line}");
    }
    // Longer than any line.
    assert_eq!(say(&mut bench, USB, &[[b'A'; 5000].as_slice(), b"\r"].concat()), "BA 2 0\\r");
    assert_eq!(say(&mut bench, USB, b"A\xFF\x1B[D\x80GAP 4\r"), "BA 2 0\\r");
    assert_eq!(ask(&mut bench, "AGAP 4, 0"), (100, 1000));
}

#[test]
fn addresses_and_what_is_left_of_replies() {
    let mut bench = entered(32);
    assert_eq!(say(&mut bench, USB, b"ASGP 76, 0, 26\r"), "BA 100 26\\r");
    assert_eq!(say(&mut bench, USB, b"ASGP 66, 0, 3\rAMST\rCMST\r"), "ZA 100 3\\rZC 100 0\\r");
    assert_eq!(say(&mut bench, USB, b"CSGP 87, 0, 4\rDMST\rdMST\r"), "ZC 100 4\\rZC 100 0\\rZC 100 0\\r");
    assert_eq!(say(&mut bench, USB, b"CSGP 255, 0, 1\r"), "ZC 100 1\\r");
    assert_eq!(say(&mut bench, USB, b"CMST\rCFOO\rCSGP 77, 0, 1\rCSAP x\rCGAP 4, 0\r"), "ZC 100 1000\\r");
    assert_eq!(say(&mut bench, USB, b"CGAP 250\rCGAP x\rCGGP\r"), "ZC 3 0\\r".repeat(3), "reading is answered");
    assert_eq!(say(&mut bench, USB, b"CBIN\r"), "");
    assert_eq!(say(&mut bench, USB, &telegram("GAP 4")), "\\x1a\\x03d\\x06\\x00\\x00\\x03\\xe8r");
    assert_eq!(say(&mut bench, USB, &telegram("139")), "");
    assert_eq!(say(&mut bench, USB, b"\rCGAP 4\r"), "ZC 100 1000\\r");
}

/// BIN is answered as text. What follows is read in binary mode, even if it came at the same time.
#[test]
fn there_and_back_in_one_go() {
    let mut bench = Bench::new();
    bench.ok("SGP 67, 0, 32");
    let one = [telegram("GAP 4").as_slice(), &telegram("139"), b"\rAGAP 4\rA BIN\r", &telegram("GAP 5")].concat();
    let expected = "\\x02\\x01d\\x06\\x00\\x00\\x03\\xe8X\\x02\\x01d\\x8b\\x00\\x00\\x00\\x00\\xf2\
                    BA 100 1000\\rBA 100 0\\r\\x02\\x01d\\x06\\x00\\x00\\x03\\xe8X";
    assert_eq!(say(&mut bench, USB, &one), expected);
    // A LF behind the CR of BIN is none of the telegram; an address of 10 is.
    let mut to_10 = binary::encode_command(10, text::parse("GAP 4").unwrap());
    let to_1 = telegram("GAP 4");
    for (end, first, second) in [("\r\n", to_1, to_10), ("\r", to_10, to_1), ("\r", to_1, to_10)] {
        bench.ok("139");
        let text = [b"ABIN", end.as_bytes(), &first, &second].concat();
        let expected = "BA 100 0\\r".to_owned() + &"\\x02\\x01d\\x06\\x00\\x00\\x03\\xe8X".repeat(2);
        assert_eq!(say(&mut bench, USB, &text), expected);
        bench.ok("139");
        assert_eq!(say(&mut bench, USB, &[b"ABIN", end.as_bytes()].concat()), "BA 100 0\\r");
        bench.module.silence(USB.source, USB.client);
        assert_eq!(bench.ok("GAP 4, 0"), 1000);
    }
    to_10[8] ^= 1;
    assert_eq!(say(&mut bench, USB, &to_10), "\\x02\\x01\\x01\\x00\\x00\\x00\\x00\\x00\\x04");
    // The same after something that is answered late.
    let two =
        [telegram("SGP 77, 0, 1").as_slice(), &telegram("139"), b"ASGP 77, 0, 0\rABIN\r", &telegram("GGP 77")].concat();
    let reply = say(&mut bench, USB, &two);
    assert!(reply.ends_with("BA 100 0\\rBA 100 0\\r\\x02\\x01d\\n\\x00\\x00\\x00\\x00q"), "{reply}");
}

/// Right behind BIN a line feed is the end of its line. After a silence it is the first byte of a telegram, an address
/// of 10. This is so for a telegram with a wrong checksum, too, which is answered as such and takes no byte of the
/// next.
#[test]
fn a_line_feed_after_bin_and_a_silence() {
    let mut broken = binary::encode_command(10, text::parse("GAP 4").unwrap());
    broken[8] ^= 1;
    let wrong = "\\x02\\x01\\x01\\x00\\x00\\x00\\x00\\x00\\x04";
    let good = "\\x02\\x01d\\x06\\x00\\x00\\x03\\xe8X";
    for (terminal, wrong) in [(USB, wrong), (RS485, "")] {
        let mut bench = Bench::new();
        bench.ok("SGP 67, 0, 32");
        let leave = |bench: &mut Bench, end: &str| {
            say(bench, terminal, &telegram("139"));
            assert_eq!(say(bench, terminal, format!("ABIN{end}").as_bytes()), "BA 100 0\\r");
        };
        for end in ["\r", "\r\n"] {
            leave(&mut bench, end);
            bench.module.silence(terminal.source, terminal.client);
            let both = [broken, telegram("GAP 4")].concat();
            assert_eq!(say(&mut bench, terminal, &both), format!("{wrong}{good}"), "{end:?}");
            // Nor is it the end of a line behind another telegram.
            leave(&mut bench, end);
            let three = [telegram("GAP 4"), broken, telegram("GAP 4")].concat();
            assert_eq!(say(&mut bench, terminal, &three), format!("{good}{wrong}{good}"), "{end:?}");
        }
        leave(&mut bench, "\r");
        assert_eq!(say(&mut bench, terminal, &broken), "", "eight bytes behind the end of the line");
        bench.module.silence(terminal.source, terminal.client);
        assert_eq!(say(&mut bench, terminal, &telegram("GAP 4")), good);
    }
}

/// A storing command is answered when it is durable, and what is typed meanwhile is not lost.
#[test]
fn storing_takes_its_time() {
    let mut bench = entered(0);
    bench.module.hear(USB.source, USB.client, b"ASGP 77, 0, 1\rAGAP 4, 0\rA");
    let mut said = String::new();
    for _ in 0..5 {
        said += &hear(&mut bench, USB, 1);
    }
    assert_eq!(said, "ASGP 77, 0, 1\\r");
    let rest = hear(&mut bench, USB, PATIENCE_MS);
    assert_eq!(rest, "BA 100 1\\rAGAP 4, 0\\rBA 100 1000\\rA");
    let eeprom = bench.eeprom();
    assert_eq!(Bench::with_eeprom(&eeprom).ok("GGP 77, 0"), 1);
}

/// Each link has a mode of its own, and a line of its own.
#[test]
fn links_are_independent() {
    let mut bench = Bench::new();
    let [one, two] = [1, 2].map(|n| Terminal { client: Client(n), ..USB });
    assert!(say(&mut bench, one, &telegram("139")).ends_with("\\xf2"));
    assert_eq!(say(&mut bench, one, b"AGA"), "AGA");
    assert_eq!(say(&mut bench, two, &telegram("GAP 4")), "\\x02\\x01d\\x06\\x00\\x00\\x03\\xe8X");
    assert_eq!(say(&mut bench, RS485, &telegram("GAP 4")), "\\x02\\x01d\\x06\\x00\\x00\\x03\\xe8X");
    assert!(say(&mut bench, two, &telegram("139")).ends_with("\\xf2"));
    assert_eq!(say(&mut bench, two, b"AMST\r"), "AMST\\rBA 100 0\\r");
    assert_eq!(say(&mut bench, one, b"P 4\r"), "P 4\\rBA 100 1000\\r");
    assert_eq!(say(&mut bench, two, b"ABIN\r"), "ABIN\\rBA 100 0\\r");
    assert_eq!(say(&mut bench, one, b"AGAP 5\r"), "AGAP 5\\rBA 100 1000\\r");
    // Whoever connects next starts anew.
    bench.module.forget(one.client);
    assert_eq!(say(&mut bench, one, &telegram("GAP 4")), "\\x02\\x01d\\x06\\x00\\x00\\x03\\xe8X");
    // 139 for another module.
    assert_eq!(say(&mut bench, RS485, &binary::encode_command(9, Command::new(139, 0, 0, 0))), "");
    assert_eq!(say(&mut bench, RS485, &telegram("GAP 4")), "\\x02\\x01d\\x06\\x00\\x00\\x03\\xe8X");
}

/// Parameter 67 says how links start from the next start of the module on: those that are always there, and
/// others when they connect.
#[test]
fn the_mode_at_the_start() {
    let mut bench = Bench::new();
    bench.ok("SGP 67, 0, 33");
    let [late, later] = [7, 8].map(|n| Terminal { client: Client(n), ..USB });
    for terminal in [USB, RS485, late] {
        assert!(say(&mut bench, terminal, &telegram("GAP 4")).ends_with('X'));
    }
    bench.power_cycle();
    for terminal in [USB, RS485, late] {
        assert_eq!(say(&mut bench, terminal, b"AGAP 4\r"), "BA 100 1000\\r");
    }
    assert_eq!(say(&mut bench, USB, b"ASGP 67, 0, 0\rABIN\r"), "BA 100 0\\rABIN\\rBA 100 0\\r");
    assert_eq!(bench.ok("GAP 4, 0"), 1000);
    assert_eq!(say(&mut bench, later, b"AGAP 4\r"), "AGAP 4\\rBA 100 1000\\r");
    bench.ok("255, 0, 0, 1234");
    bench.run(PATIENCE_MS * MILLISECOND);
    for terminal in [USB, RS485, late, later] {
        assert!(say(&mut bench, terminal, &telegram("GAP 4")).ends_with('X'));
    }
}

/// The event of command 138 comes in the form of the mode that its link is in.
#[test]
fn an_event_in_digits() {
    let mut bench = entered(32);
    assert_eq!(say(&mut bench, USB, b"ABIN\r"), "BA 100 0\\r");
    bench.ok("138, 0, 0, 1");
    bench.ok("139");
    assert_eq!(say(&mut bench, USB, b"AMVP REL, 0, 51200\rAGA"), "BA 100 51200\\r");
    assert_eq!(hear(&mut bench, USB, 5000), "BA 128 1\\r");
    assert_eq!(say(&mut bench, USB, b"P 1\r"), "BA 100 51200\\r");
}

/// Noise does no harm: every line for this module has one answer, and the next is understood.
#[test]
fn noise() {
    let lines = random_inputs(4_000);
    const WORDS: [&[u8]; 16] = [
        b"A",
        b"a",
        b"B",
        b"GAP 4",
        b"gap",
        b"MST",
        b"GGP 5, 2",
        b",",
        b" ",
        b"\x08",
        b"\x7F",
        b"-5",
        b"$FF",
        b"0",
        b"\n",
        b"XYZZY",
    ];
    let mut bench = entered(32);
    let mut seed = 0x1140_u64;
    let mut below = |limit: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % limit
    };
    for number in 0..lines {
        let mut line = Vec::new();
        for _ in 0..below(12) {
            match below(4) {
                0 => line.push(below(256) as u8),
                _ => line.extend_from_slice(WORDS[below(WORDS.len())]),
            }
        }
        // Nothing that leaves ASCII mode, changes the address, or stores.
        line.retain(|byte| !b"\rnNsS".contains(byte));
        bench.module.hear(USB.source, USB.client, &line);
        bench.module.hear(USB.source, USB.client, b"\rAGAP 4, 0\r");
        let heard = hear(&mut bench, USB, 3);
        let replies: Vec<&str> = heard.split_terminator("\\r").collect();
        let shown = line.escape_ascii();
        assert!(heard.ends_with("\\r") && replies.len() <= 2, "{number}: {shown}: {heard}");
        assert!(replies.iter().all(|reply| reply.starts_with("BA ")), "{number}: {shown}: {heard}");
        assert_eq!(replies.last(), Some(&"BA 100 1000"), "{number}: {shown}");
    }
}
