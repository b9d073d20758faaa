//! The behaviour of the virtual TMCM-1140, frozen byte for byte: its replies, the SPI datagrams to its chips, and the
//! contents of its EEPROM. This test shows which behaviour a change of the code has altered; other tests show whether
//! the behaviour is right.
//!
//! Each file of this directory with the ending `txt` holds dialogues: requests, with the replies behind or below them.
//! `script.rs` describes the format. Below each dialogue stand a check sum of all datagrams to motion controller and
//! driver in their order, and a check sum of the EEPROM's contents at the end. Replies have no times, but requests are
//! sent at fixed times, and a firmware that polls its chips at other times sends other datagrams.
//!
//! `eeprom.bin` holds the contents of an EEPROM that `eeprom_write.txt` fills with settings of all kinds, coordinates,
//! user variables and a program that starts by itself; `eeprom_read.txt` starts modules with these contents and reads
//! them.
//!
//! `UPDATE_FROZEN=1 cargo test --test module frozen` writes the files and `eeprom.bin` anew. A deliberate change of
//! behaviour comes in a commit of its own that shows the difference. With `FROZEN_DATAGRAMS=directory` in the
//! environment the test writes the datagrams of each dialogue to files in that directory; done before and after a
//! change, `diff` shows the first difference.

mod rig;
mod script;

use std::path::PathBuf;
use std::thread;

use rig::EEPROM_SIZE;

/// The outcome of playing a file of dialogues.
struct Played {
    path: PathBuf,
    before: String,
    after: String,
    /// Name and contents of an EEPROM file that the dialogues save.
    eeprom: Option<(String, Vec<u8>)>,
}

fn directory() -> PathBuf {
    xtask::workspace().unwrap().join("tests/module/frozen")
}

fn play(path: PathBuf) -> Played {
    let before = std::fs::read_to_string(&path).unwrap().replace("\r\n", "\n");
    let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
    let (after, eeprom) = script::play(&name, &before);
    Played { path, before, after, eeprom }
}

/// Number and texts of the first line in which two texts differ; `None` if they are equal.
fn difference(before: &str, after: &str) -> Option<String> {
    let (mut old, mut new) = (before.lines(), after.lines());
    let mut number = 0;
    loop {
        number += 1;
        let (old, new) = (old.next(), new.next());
        if old != new {
            return Some(format!("line {number}:\n- {}\n+ {}", old.unwrap_or_default(), new.unwrap_or_default()));
        }
        old?;
    }
}

#[test]
fn replies_datagrams_and_eeprom_have_not_changed() {
    let update = std::env::var_os("UPDATE_FROZEN").is_some_and(|value| value == "1");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(directory()).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "txt"));
    paths.sort();
    // The dialogues that read the EEPROM file are played after those that write it.
    let (readers, others): (Vec<_>, Vec<_>) = paths.into_iter().partition(|path| path.ends_with("eeprom_read.txt"));
    assert!(!readers.is_empty() && !others.is_empty());
    let mut differences = Vec::new();
    for paths in [others, readers] {
        let played: Vec<Played> = thread::scope(|scope| {
            let threads: Vec<_> = paths.into_iter().map(|path| scope.spawn(|| play(path))).collect();
            threads.into_iter().map(|thread| thread.join().expect("see above")).collect()
        });
        for Played { path, before, after, eeprom } in played {
            if update {
                std::fs::write(&path, &after).unwrap();
            } else if let Some(difference) = difference(&before, &after) {
                differences.push(format!("{}, {difference}", path.display()));
            }
            let Some((name, contents)) = eeprom else { continue };
            assert_eq!(contents.len(), EEPROM_SIZE);
            let path = directory().join(name);
            if update {
                std::fs::write(&path, contents).unwrap();
            } else if let Some(at) = contents.iter().zip(&std::fs::read(&path).unwrap()).position(|(a, b)| a != b) {
                differences.push(format!("{}, byte {at} has become different", path.display()));
            }
        }
    }
    assert!(differences.is_empty(), "UPDATE_FROZEN=1 writes what is now:\n{}", differences.join("\n"));
}
