//! The tests of the program that run on Windows as well: the program that mingw has linked, under wine.
//!
//! `cargo test -p tmcl-cli --test tmcl -- --ignored on_windows` builds that program and runs all tests but [`APART`]
//! with it in the place of the one for this system. It needs wine and mingw, says so where they are missing, and is
//! ignored by who has not asked for it.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use rustix::process::Signal;

use crate::harness::{PROGRAM, Sim, tmcl_path};

/// Rust's name of the system.
const TARGET: &str = "x86_64-pc-windows-gnu";

/// Tests that do not run there, each group with its reason: a file of tests, or one test. All others do.
const APART: [(&str, &[&str]); 7] = [
    (
        "serial ports and terminals that are pseudo terminals, which Windows does not have",
        &[
            "addresses::a_late_reply_of_another_module_on_a_bus_is_none",
            "addresses::a_link_to_one_module_takes_its_reply_whatever_the_address",
            "asks::time_may_go_by_the_clock_or_be_somebody_elses",
            "bad_links::ports_in_use",
            "canopen::over_usb_a_node_tells_its_version_and_nothing_else",
            "canopen::what_is_saved_is_in_the_file",
            "colours::a_terminal_has_them_unless_they_are_not_wanted",
            "control::with_the_usb_cable_out_nothing_arrives_and_nothing_is_left_of_what_was_begun",
            "debug_terminal::a_link_that_fails_ends_it_with_the_terminal_as_before",
            "debug_terminal::lines_are_edited_repeated_and_completed",
            "debug_terminal::narrow_terminals_and_short_scripts",
            "debug_terminal::the_terminal_gets_its_settings_back",
            "dump::a_dump_that_fails_leaves_the_file_as_it_is",
            "help::every_command_has_examples_that_work",
            "link_faults",
            "links::a_link_left_behind_is_replaced",
            "links::after_a_silence_it_is_in_step_again",
            "links::everybody_gets_its_own_replies",
            "links::telegrams_arrive_in_pieces",
            "links::the_serial_port_survives_its_hosts_and_goes_with_the_module",
            "links::without_options_there_is_a_link_of_each_kind",
            "messages::files_of_the_user_are_never_replaced_by_a_link",
            "monitor::a_module_that_vanishes_ends_the_line_before_the_message",
            "monitor::a_narrow_terminal_is_left_as_it_was",
            "monitor::a_terminal_has_one_line_for_all_axes",
            "monitor::what_does_not_answer_well_is_told_in_one_sentence",
            "params::interfaces_are_restored_on_demand",
            "params::settings_are_compared",
            "ports",
            "programs::a_source_is_debugged_by_its_labels",
            "programs::from_an_empty_editor_to_a_program_that_starts_by_itself",
            "programs::programs_are_loaded_over_every_link",
            "scan",
            "send::a_serial_device_may_have_any_baud_rate_and_name",
            "send::replies_are_the_same_over_every_link",
            "send::three_modules_on_two_buses",
            "shell",
            "shell_jog",
            "shell_jog_faults",
            "sim_products::different_products_share_the_buses",
            "sim_products::each_product_has_an_eeprom_of_its_own_size",
            "sim_products::module_2_hears_what_is_for_any_of_its_axes",
            "sim_products::settings_of_another_product_are_left_alone",
            "sim_products::there_may_be_127_modules",
            "sim_products::what_is_printed_reaches_each_product",
            "starts",
            "telegrams::a_simulator_logs_what_the_clients_of_all_links_say",
            "telegrams::every_command_that_talks_to_a_module_logs_from_the_hosts_side",
            "time",
            "time_hosts",
            "time_steps",
            "time_watch",
            "tune_asks",
            "tune_ends::an_older_drawing_stays_until_there_is_a_new_one",
            "tune_plan",
            "tune_progress",
        ],
    ),
    (
        "signals: wine ends a program by them, and makes no events of a console of them",
        &[
            "bad_ends::signals_end_every_tool_at_once",
            "bad_ends::signals_end_what_waits_for_standard_input",
            "debug_terminal::a_changed_file_is_loaded_again",
            "debug_terminal::a_program_that_runs_is_interrupted",
            "ending",
            "params::what_is_interrupted_is_told_and_nothing_is_lost",
            "programs::a_download_that_is_interrupted_leaves_nothing_to_run",
            "run_faults::a_run_can_be_interrupted",
            "tune_ends::a_signal_stops_the_motor_and_puts_everything_back",
            "tune_ends::a_signal_takes_the_load_away",
            "tune_limits::a_signal_ends_the_wait_for_a_motor_that_does_not_come_back",
            "tune_limits::a_signal_ends_the_wait_for_a_motor_that_does_not_stop",
            "tune_limits::after_a_signal_the_motor_has_the_time_to_stop",
        ],
    ),
    (
        "files, names and permissions that only Unix has: /dev/full, pipes, modes, characters that no name has on Windows",
        &[
            "bad_ends::standard_output_that_is_closed",
            "bad_input::errors_of_the_system_are_said_in_words",
            "debug::wrong_files_and_links_are_told",
            "eeprom::a_file_has_one_simulator_at_a_time",
            "eeprom::what_cannot_be_an_eeprom_is_left_alone",
            "eeprom::with_a_full_disk_a_store_is_answered_with_status_5",
            "foreign_text::what_stands_in_files_controls_no_terminal",
            "messages::files_that_are_far_too_large_are_not_read",
            "telegrams::a_log_that_cannot_be_written_is_told_before_anything_is_sent",
        ],
    ),
    (
        "the lock of an EEPROM's file, which is a file beside it on Windows",
        &[
            "eeprom::new_files_of_a_simulator_that_was_killed_are_removed",
            "eeprom::nobody_can_foresee_the_name_of_the_new_file",
            "eeprom::of_two_that_start_together_on_a_new_file_one_is_refused",
        ],
    ),
    (
        "texts that are others on Windows: the name of the program, paths, what is to be tried in place of a serial port",
        &[
            "messages::help_is_there",
            "messages::links_that_cannot_be_opened_are_told",
            "scenarios::files_come_from_folders_and_from_standard_input",
        ],
    ),
    (
        "the flash images: what emulates the microcontroller is the same on all systems, and takes minutes",
        &["canopen::two_firmwares_share_a_file", "image", "image_canopen", "image_hosts", "image_sisters"],
    ),
    (
        "what asks Git or a shell of this checkout",
        &["book", "help::the_version_names_the_commit_of_the_checkout", "library", "windows"],
    ),
];

/// The tests that run there, by their names.
fn run() -> Vec<String> {
    let listed = Command::new(std::env::current_exe().unwrap()).args(["--list", "--format=terse"]).output().unwrap();
    let listed = String::from_utf8(listed.stdout).unwrap();
    let all: Vec<&str> = listed.lines().filter_map(|line| line.strip_suffix(": test")).collect();
    let apart = || APART.iter().flat_map(|(_, names)| names.iter().copied());
    let is_of = |test: &str, name: &str| test == name || test.split("::").next() == Some(name);
    for name in apart() {
        assert!(all.iter().any(|test| is_of(test, name)), "there is no {name}");
    }
    all.into_iter().filter(|test| !apart().any(|name| is_of(test, name))).map(str::to_owned).collect()
}

#[test]
fn what_does_not_run_on_windows_exists() {
    assert!(run().len() > 200, "{}", run().len());
}

/// Runs a program to its end; `missing` says what to do if there is no such program.
fn carry_out(command: &mut Command, missing: &str) {
    let status =
        command.stdin(Stdio::null()).status().unwrap_or_else(|error| panic!("{command:?}: {error}. {missing}"));
    assert!(status.success(), "{command:?}: {status}");
}

/// The source of a library that older wines lack.
const RANDOM: &str = "scripts/bcryptprimitives.c";

/// The program for Windows, in the form of a script that runs it under wine.
fn built() -> PathBuf {
    const LINKER: &str = "x86_64-w64-mingw32-gcc";
    const MINGW: &str = "This test needs mingw: apt-get install gcc-mingw-w64-x86-64";
    const WINE: &str = "This test needs wine: apt-get install --no-install-recommends wine wine64";
    carry_out(Command::new(LINKER).arg("--version").stdout(Stdio::null()), MINGW);
    carry_out(Command::new("wine").arg("--version").stdout(Stdio::null()), WINE);
    xtask::library(TARGET, "the program for Windows").unwrap();
    // In a folder of its own, so that no other Cargo waits for it.
    let target = PathBuf::from(tmcl_path()).ancestors().nth(2).unwrap().join("foreign");
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--quiet", "--profile", "foreign", "-p", "tmcl-cli", "--target", TARGET, "--target-dir"]);
    cargo.arg(&target);
    let workspace = xtask::workspace().unwrap();
    carry_out(cargo.current_dir(&workspace), "");
    let folder = target.join(TARGET).join("foreign");
    let (source, script) = (workspace.join(RANDOM), folder.join("tmcl"));
    let library = folder.join("bcryptprimitives.dll");
    carry_out(Command::new(LINKER).args(["-shared", "-o"]).arg(library).arg(source).arg("-ladvapi32"), MINGW);
    let folder = folder.display();
    let wine =
        format!("#!/bin/sh\nexport WINEPREFIX='{folder}/wine' WINEDEBUG=-all\nexec wine '{folder}/tmcl.exe' \"$@\"\n");
    fs::write(&script, wine).unwrap();
    fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).unwrap();
    carry_out(Command::new(&script).arg("--version"), WINE);
    script
}

#[test]
#[ignore = "needs wine and mingw"]
fn on_windows() {
    let program = built();
    let elsewhere = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", elsewhere.told("tcp"));
    let asked = Command::new(&program).args(["send", &link, "SGP 68, 0, 7", "GGP 68, 0"]).output().unwrap();
    assert!(String::from_utf8_lossy(&asked.stdout).contains("GGP 68, 0: 7 "), "{asked:?}");
    assert_eq!(elsewhere.tcp().ok("GGP 68, 0"), 7);
    an_eeprom_has_one_simulator_at_a_time(&program);
    let mut command = Command::new(std::env::current_exe().unwrap());
    carry_out(command.env(PROGRAM, program).args(["--exact", "--quiet"]).args(run()), "");
}

/// The lock is a file beside the EEPROM's, which goes with the simulator, however that ends.
fn an_eeprom_has_one_simulator_at_a_time(program: &Path) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("module.bin");
    let start = || {
        let mut command = Command::new(program);
        command.args(["sim", "--tcp", "127.0.0.1:0", "--eeprom"]).arg(&file).stdout(Stdio::piped());
        command
    };
    let first = Sim::start_as(folder, &mut start());
    first.tcp().ok("SGP 68, 0, 7");
    let second = start().output().unwrap();
    assert_eq!(second.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&second.stderr).contains("of another simulator that runs"), "{second:?}");
    let (_, folder) = first.end(Signal::KILL);
    let third = Sim::start_as(folder, &mut start());
    assert_eq!(third.tcp().ok("GGP 68, 0"), 7);
}
