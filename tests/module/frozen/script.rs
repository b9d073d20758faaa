//! Dialogues as text. `==` and a title begin a dialogue with a fresh module; lines `world KEY = VALUE` below the title
//! describe the world, and `eeprom FILE` names the EEPROM's contents. `save FILE` at the end of a dialogue saves them.
//!
//! A line consists of steps, with `|` between them:
//! * `GAP 4, 0`: a command over USB; `RS485 1: GAP 4, 0`, `USB 2: GAP 4, 0`: to this address;
//!   `CAN 1 7: GAP 4, 0`: to this identifier with so many bytes
//! * `bytes USB 01 06 04`: bytes as they are; `frame 1 01 02`: a frame; `silence USB`: a pause, which ends a telegram
//! * `type USB AGAP 4, 0\r`: text for ASCII mode
//! * `wait 500 ms`, `control press left`, `power cycle`, `power off`, `power on`, `usb off`, `usb on`
//! * `look`: rotor, current and outputs of the world; `fresh`: a new module in the same world
//!
//! Behind ` -> ` stand the answers, one for each step that has an answer. A step that only lets time pass has one if
//! the module has sent something unasked. A reply of nine bytes with a right check sum is written as status and value.
//! The value is left out if it is the value of the request and not zero; `:` and the command number follow if it is not
//! the number of the request; `host<module` precedes the reply unless the addresses are 2 and 1. Other bytes are
//! written in hexadecimal, a frame with its identifier, text in quotation marks. Another link than that of the request
//! is named. `-` stands for no answer.
//!
//! `for n = 0..13, 15; v = 0, 1: SAP $n, 0, $v` carries the steps out for each n, and within that for each v. Each line
//! below has the answers for an n, or for successive n with the same answers.

use super::directory;
use super::rig::{Rig, Sums};

/// Separator of steps, and of answers.
const BETWEEN: &str = " | ";

/// The dialogue that is being played.
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

    /// Carries the steps of a line out and returns the answers.
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

    /// Carries a loop out and returns the lines of answers below it.
    fn repeat(&mut self, header: &str, body: &str) -> Vec<String> {
        let mut variables = header.split(';').map(|variable| {
            let (name, values) = variable.split_once('=').expect("for NAME = VALUES: STEPS");
            (format!("${}", name.trim()), values_of(values))
        });
        let (outer, values) = variables.next().unwrap();
        let inner = variables.next();
        // Each line: first and last value of the loop variable with the same answer, and the answer.
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

    /// The line with the check sums below a dialogue.
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

/// Plays the dialogues of a file; returns the text with the present answers, and name and contents of an EEPROM to
/// save.
pub(super) fn play(file: &str, text: &str) -> (String, Option<(String, Vec<u8>)>) {
    let mut lines: Vec<String> = Vec::new();
    // Length of the text up to the end of the dialogue's last line.
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
