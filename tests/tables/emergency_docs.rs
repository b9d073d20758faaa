//! The table of emergencies in `docs/canopen.md` is made from the firmware's own.

use tmcm::canopen::{Emergency, Reaction};

use common::pages::compare;

/// The head of the table.
const HEAD: &str = "| message | bytes | meaning | 1001h | the drive |\n|---|---|---|---|---|\n";

fn row(emergency: Emergency) -> String {
    let (code, [first, second], register, meaning) = emergency.data();
    let bits: Vec<_> = (0..8).filter(|bit| register >> bit & 1 != 0).map(|bit| bit.to_string()).collect();
    let reaction = match emergency.reaction() {
        Reaction::Message => "",
        Reaction::Stop => "stops, bit 11 of the statusword",
        Reaction::Fault => "stops, FAULT",
    };
    let cells = [format!("{code:04X}h"), format!("{first} {second}"), meaning.into(), bits.join(" "), reaction.into()];
    format!("| {} |\n", cells.join(" | ").replace("|  |", "| |")).replace("  |", " |")
}

#[test]
fn the_table_of_emergencies() {
    let path = xtask::workspace().unwrap().join("docs/canopen.md");
    let page = std::fs::read_to_string(path).unwrap().replace("\r\n", "\n");
    let (before, rest) = page.split_once(HEAD).expect("docs/canopen.md has the head of the table");
    // The table ends at the first line that is none of its rows.
    let old: usize = rest.split_inclusive('\n').take_while(|line| line.starts_with('|')).map(str::len).sum();
    let rows: String = Emergency::ALL.iter().copied().map(row).collect();
    compare("canopen.md", "--test tables emergency_docs", &format!("{before}{HEAD}{rows}{}", &rest[old..]));
}
