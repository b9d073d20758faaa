//! Dialogues as text. `==` and a title begin one: with a fresh module in the world that the lines `world KEY = VALUE`
//! below it describe, or with the EEPROM that `eeprom FILE` names. `save FILE` at its end keeps the EEPROM.
//!
//! A line has steps, with `|` between them:
//! * `GAP 4, 0`: a command over USB; `RS485 1: GAP 4, 0`, `USB 2: GAP 4, 0`: to this address;
//!   `CAN 1 7: GAP 4, 0`: to this identifier with so many bytes
//! * `bytes USB 01 06 04`: bytes as they are; `frame 1 01 02`: a frame; `silence USB`: a pause, which ends a telegram
//! * `type USB AGAP 4, 0\r`: text for ASCII mode
//! * `wait 500 ms`, `control press left`, `power cycle`, `power off`, `power on`, `usb off`, `usb on`
//! * `look`: rotor, current and outputs, as the world has them; `fresh`: another module in the same world
//!
//! Behind ` -> ` stands what came, for each step that has an answer; steps that only let time pass have one if
//! something came by itself. A reply in nine bytes with a right check sum is written as status and value; the value is
//! left out where it is that of the request and not zero, `:` and the command number stand where it is another one, and
//! `host<module` before it all unless these are 2 and 1. Anything else is in hexadecimal, a frame with its identifier,
//! text in quotation marks. Another link than the request's is named. `-` is no answer.
//!
//! `for n = 0..13, 15; v = 0, 1: SAP $n, 0, $v` carries steps out for each n, and for each v within. A line below
//! tells what came for an n, or for several of the list in a row where that is the same.

use super::directory;
use super::rig::{Rig, Sums};

/// What stands between steps, and between answers.
const BETWEEN: &str = " | ";

/// A dialogue that is going on.
struct Dialogue {
    name: String,
    world: String,
    eeprom: Option<Vec<u8>>,
    rig: Option<Rig>,
    sums: Sums,
}

impl Dialogue {
    fn new(name: String) -> Self {
        Dialogue { name, world: String::new(), eeprom: None, rig: None, sums: Sums::new() }
    }

    fn rig(&mut self) -> &mut Rig {
        self.rig.get_or_insert_with(|| Rig::new(&self.world, self.eeprom.as_deref()))
    }

    /// Carries steps out and gives the answers.
    fn steps(&mut self, line: &str) -> String {
        let mut answers = Vec::new();
        for step in line.split('|').map(str::trim) {
            if step == "fresh" {
                self.rig = None;
                self.rig();
                continue;
            }
            let answer = self.rig().step(step);
            answers.extend(answer.unwrap_or_else(|error| panic!("{line}: {step}: {error}")));
            let datagrams = self.rig().take_datagrams();
            datagrams.iter().for_each(|datagram| self.sums.add(datagram));
        }
        answers.join(BETWEEN)
    }

    /// Carries a loop out and gives the lines below it.
    fn repeat(&mut self, header: &str, body: &str) -> Vec<String> {
        let mut variables = header.split(';').map(|variable| {
            let (name, values) = variable.split_once('=').expect("for NAME = VALUES: STEPS");
            (format!("${}", name.trim()), values_of(values))
        });
        let (outer, values) = variables.next().unwrap();
        let inner = variables.next();
        // First and last value with an answer, and the answer.
        let mut lines: Vec<(i64, i64, String)> = Vec::new();
        for value in values {
            let body = body.replace(&outer, &value.to_string());
            let answer = match &inner {
                None => self.steps(&body),
                Some((name, values)) => {
                    let each = values.iter().map(|inner| {
                        let answer = self.steps(&body.replace(name, &inner.to_string()));
                        format!("[{inner}] {answer}")
                    });
                    each.collect::<Vec<_>>().join(" ")
                }
            };
            match lines.last_mut() {
                Some((_, last, same)) if *same == answer => *last = value,
                _ => lines.push((value, value, answer)),
            }
        }
        let shown = lines.into_iter().map(|(first, last, answer)| {
            let values = if first == last { first.to_string() } else { format!("{first}..{last}") };
            format!("  {values}: {answer}").trim_end().to_owned()
        });
        shown.collect()
    }

    /// The line below a dialogue.
    fn end(mut self, file: &str) -> String {
        let eeprom = self.rig().eeprom();
        self.sums.write(file, &self.name);
        format!("  {}", self.sums.line(&eeprom))
    }
}

fn values_of(text: &str) -> Vec<i64> {
    let number = |text: &str| text.trim().parse().unwrap_or_else(|_| panic!("'{text}' is not a number"));
    let values = text.split(',').flat_map(|part| match part.split_once("..") {
        Some((first, last)) => (number(first)..=number(last)).collect::<Vec<i64>>(),
        None => vec![number(part)],
    });
    values.collect()
}

/// The text with the answers that come now, and an EEPROM to be kept.
pub(super) fn play(file: &str, text: &str) -> (String, Option<(String, Vec<u8>)>) {
    let mut lines: Vec<String> = Vec::new();
    // Where the last line of the dialogue that goes on ends.
    let mut end = 0;
    let mut dialogue: Option<Dialogue> = None;
    let mut saved = None;
    for line in text.lines().filter(|line| !line.starts_with("  ")) {
        if line.is_empty() || line.starts_with('#') {
            lines.push(line.into());
            continue;
        }
        if let Some(title) = line.strip_prefix("== ") {
            if let Some(last) = dialogue.replace(Dialogue::new(title.into())) {
                lines.insert(end, last.end(file));
            }
            lines.push(line.into());
            continue;
        }
        let now = dialogue.as_mut().expect("a dialogue begins with ==");
        let steps = line.split(" -> ").next().unwrap();
        if let Some(entry) = line.strip_prefix("world ") {
            now.world += &format!("{entry}\n");
            lines.push(line.into());
        } else if let Some(name) = line.strip_prefix("eeprom ") {
            now.eeprom = Some(std::fs::read(directory().join(name)).unwrap());
            lines.push(line.into());
        } else if let Some(name) = line.strip_prefix("save ") {
            saved = Some((name.to_owned(), now.rig().eeprom()));
            lines.push(line.into());
        } else if let Some((header, body)) = line.strip_prefix("for ").and_then(|rest| rest.split_once(": ")) {
            lines.push(line.into());
            lines.extend(now.repeat(header, body));
        } else {
            let answer = now.steps(steps);
            lines.push(if answer.is_empty() { steps.into() } else { format!("{steps} -> {answer}") });
        }
        end = lines.len();
    }
    if let Some(last) = dialogue {
        lines.insert(end, last.end(file));
    }
    (lines.join("\n") + "\n", saved)
}
