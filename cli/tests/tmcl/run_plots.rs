//! `tmcl run --plot`: what is drawn, and where it goes.

use super::harness::{complaint, names, tmcl};
use super::page::words;
use super::run::{Folder, row};

/// The tags of an XML document, which must be well-formed as far as tags go, and its texts.
pub(crate) fn texts(xml: &str) -> Vec<&str> {
    let (mut open, mut texts) = (Vec::new(), Vec::new());
    let mut rest = xml;
    while let Some((text, after)) = rest.split_once('<') {
        texts.extend(Some(text.trim()).filter(|text| !text.is_empty()));
        let (tag, after) = after.split_once('>').expect("a tag without an end");
        let name = tag.split([' ', '\n']).next().unwrap();
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        if let Some(name) = name.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(name);
        }
        rest = after;
    }
    assert!(open.is_empty(), "{open:?} not closed");
    assert_eq!(rest.trim(), "");
    texts
}

#[test]
fn a_plot_has_its_panels_and_stays_small() {
    let folder = Folder::with(
        "SAP 174, 0, 1\nVECT 0, Blink\nSGP 0, 3, 7\nEI 0\nEI 255\nSAP 4, 0, 2000\nSAP 4, 0, 9000\n\
         Loop: MVP ABS, 0, 9000\nWAIT POS, 0, 0\nMVP ABS, 0, 0\nWAIT POS, 0, 0\nJA Loop\n\
         Blink: SIO 0, 2, 1\nSIO 1, 2, 0\nRETI\n",
    );
    folder.write("world.toml", "[motor]\nstall_guard_noise = 100\n");
    let options = ["program.tmc", "--world", "world.toml", "--plot", "out.svg", "--until"];
    let report = folder.shown(&[&options[..], &["3 s", "--at", "1 s: load 0.2"]].concat());
    assert_eq!(row(&report, "plot"), "out.svg");
    let svg = folder.read("out.svg");
    let texts = texts(&svg);
    for text in [
        "program.tmc",
        "3 s of virtual time",
        "position in microsteps",
        "velocity in internal units",
        "stallGuard2 value (parameter 206): 0 is a stall",
        "motor current in 1/32 of full scale",
        "OUT0",
        "Blink",
        "no effect",
        "load 0.2",
        "time in seconds",
    ] {
        assert!(texts.contains(&text), "{text} is not among {texts:?}");
    }
    // What never changes, and a rotor that is where it should be, are not drawn.
    for text in ["STOP", "left switch", "home switch", "OUT1", "IN0", "rotor, steps lost"] {
        assert!(!texts.contains(&text), "{text}");
    }
    folder.shown(&[&options[..], &["10 min"]].concat());
    assert!(folder.read("out.svg").len() < 200_000, "{}", folder.read("out.svg").len());
}

/// The plot opens its file before the run, so that no run is in vain, and goes to standard output by `-`.
#[test]
fn a_plot_goes_where_it_is_wanted() {
    let folder = Folder::with("ROR 0, 500\nWAIT TICKS, 0, 10\nSTOP\n");
    let output = folder.run(&["program.tmc", "--plot", "-"]);
    assert!(output.status.success());
    let svg = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(texts(&svg).contains(&"program.tmc"));
    let report = complaint(&output);
    assert_eq!((row(&report, "end"), row(&report, "plot")), ("STOP at address 2", "standard output"));
    // A thousand hours would not end before the file is found to be impossible.
    let told = folder.complaint(1, &["program.tmc", "--until", "1000 h", "--plot", "none/out.svg"]);
    assert!(told.contains("cannot write none/out.svg"), "{told}");
    let told = folder.complaint(2, &["program.tmc", "--until", "1000 h", "--plot", "out.png"]);
    assert!(told.contains("give a name like plot.svg"), "{told}");
    assert_eq!(names(folder.0.path()), ["program.tmc"]);
    let output = folder.run(&["program.tmc", "--trace", "-"]);
    assert!(String::from_utf8(output.stdout).unwrap().contains("ROR 0, 500"));
}

/// Inputs, switches and the rotor are drawn where they say something: a motor that loses its steps at a hard end, and a
/// hand at an input and a switch.
#[test]
fn a_plot_shows_what_changes() {
    let folder = Folder::with("ROR 0, 500\nWAIT TICKS, 0, 100\nMST 0\nSTOP\n");
    folder.write("world.toml", "[stage]\nhard_right = 5000\n[motor]\nstall_guard_zero = 63\n");
    let events = ["--at", "100 ms: input 0 1", "--at", "200 ms: press left", "--at", "300 ms: release left"];
    let options = ["program.tmc", "--plot", "-", "--world", "world.toml"];
    let svg = String::from_utf8(folder.run(&[&options[..], &events[..]].concat()).stdout).unwrap();
    let there = texts(&svg);
    for text in ["rotor, steps lost", "out of step", "IN0", "left switch"] {
        assert!(there.contains(&text), "{text} is not among {there:?}");
    }
    assert!(!there.contains(&"right switch") && !there.contains(&"OUT0"), "{there:?}");
    // The threshold is far from what this motor needs: the load value is 0, and says nothing.
    assert!(!there.iter().any(|text| text.starts_with("stallGuard2")), "{there:?}");
}

#[test]
fn several_axes_move_and_are_drawn() {
    let folder = Folder::with(
        "#include TMCLParam.tmc\nSAP APMaxPositioningSpeed, Motor2, 2000\nMVP ABS, Motor0, 2000\nMVP ABS, Motor2, -51200\n\
         SIO 5, 2, 1\nWAIT POS, Motor2, 0\nSTOP\n",
    );
    for product in ["3110", "tmcm-6110"] {
        let events = ["--at", "400 ms: press home 2", "--at", "500 ms: load 0.5 1", "--at", "600 ms: release home 2"];
        let options = ["program.tmc", "--product", product, "--plot", "out.svg"];
        let report = folder.shown(&[&options[..], &events[..]].concat());
        assert_eq!(row(&report, "axis 0"), "position 2000 microsteps; velocity 0 (internal units): the motor stands");
        assert_eq!(row(&report, "axis 2"), "position -51200 microsteps; velocity 0 (internal units): the motor stands");
        assert_eq!(report.contains("axis 5"), product != "3110", "{report}");
        assert!(row(&report, "outputs").ends_with("OUT4 off, OUT5 on, OUT6 off, OUT7 off"), "{report}");
        let svg = folder.read("out.svg");
        let texts = texts(&svg);
        for text in [
            "axis 0: position in microsteps",
            "axis 0: velocity in internal units",
            "axis 2: position in microsteps",
            "OUT5",
            "home switch 2",
        ] {
            assert!(texts.contains(&text), "{text} is not among {texts:?}");
        }
        let idle = |text: &&str| {
            text.starts_with("axis 1") || text.contains("current") || text.starts_with("left") || *text == "OUT0"
        };
        assert!(!texts.iter().any(idle), "{texts:?}");
    }
    // Another product has its speeds in another unit.
    folder.write("pps.tmc", "ROR 1, 40000\nWAIT TICKS, 0, 100\nSTOP\n");
    let report = folder.shown(&["pps.tmc", "--product", "3212", "--at", "500 ms: GAP 3, 1", "--plot", "pps.svg"]);
    assert!(row(&report, "axis 1").ends_with(" microsteps; velocity 40000 (pps): the motor turns"), "{report}");
    assert_eq!(row(&report, "axis 0"), "position 0 microsteps; velocity 0 (pps): the motor stands");
    assert!(row(&report, "events").contains(" pps (actual speed), status 100 ok"), "{report}");
    let svg = folder.read("pps.svg");
    assert!(texts(&svg).contains(&"axis 1: velocity in pps") && texts(&svg).contains(&"40\u{2009}000"), "{svg}");
    let told = folder.complaint(2, &["program.tmc", "--product", "3110", "--at", "1 s: press home 3"]);
    assert_eq!(told, "tmcl: --at 'press home 3': no axis 3: the TMCM-3110 has axes 0 to 2\n");
    assert!(folder.complaint(1, &["program.tmc"]).contains("unknown name 'Motor2'"));
    folder.write("still.tmc", "STOP\n");
    folder.shown(&["still.tmc", "--product", "3110", "--plot", "out.svg"]);
    assert!(texts(&folder.read("out.svg")).contains(&"axis 0: position in microsteps"));
    // A world has room for three axes.
    folder.write("world.toml", "[[axis]]\n[[axis]]\n[[axis]]\nmotor.start = 7\n[axis.stage]\nhard_left = -20000\n");
    let report = folder.shown(&["program.tmc", "--product", "3110", "--world", "world.toml"]);
    assert!(row(&report, "axis 2").contains("; the motor has lost steps, it is "), "{report}");
    assert!(folder.complaint(1, &["still.tmc", "--world", "world.toml"]).contains("the TMCM-1140 has one axis"));
}

/// Plots in `docs` are what the commands in the comments of the examples draw. `UPDATE_DOCS=1` in the environment
/// writes them anew.
#[test]
fn the_plots_of_the_examples_are_up_to_date() {
    let root = xtask::workspace().unwrap();
    let page = std::fs::read_to_string(root.join("examples/README.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let names = ["homing_axes", "straight_line", "pick_and_place", "six_point_ramp"];
    for name in names {
        assert!(page.contains(&format!("(../docs/{name}.svg)")), "{name}");
        let source = std::fs::read_to_string(root.join(format!("examples/{name}.tmc"))).unwrap();
        // The command and the lines with further options are indented.
        let lines = source.lines().filter_map(|line| line.strip_prefix("//     "));
        let command =
            lines.filter(|line| line.contains(" --") || line.starts_with("tmcl ")).collect::<Vec<_>>().join(" ");
        let (plot, drawn) = (format!("{name}.svg"), folder.path().join(format!("{name}.svg")));
        let words: Vec<String> = words(&command)
            .into_iter()
            .map(|word| if word == plot { drawn.to_str().unwrap().to_owned() } else { word })
            .collect();
        assert_eq!(words[..2], ["tmcl", "run"], "{command}");
        let words: Vec<&str> = words[1..].iter().map(String::as_str).collect();
        let output = tmcl(&words).current_dir(&root).output().unwrap();
        assert!(output.status.success(), "{command}: {}", complaint(&output));
        let there = root.join("docs").join(plot);
        if std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1") {
            std::fs::copy(&drawn, &there).unwrap();
        }
        let same = std::fs::read(&there).is_ok_and(|found| found == std::fs::read(&drawn).unwrap());
        assert!(same, "docs/{name}.svg is stale: UPDATE_DOCS=1 cargo test -p tmcl-cli --test tmcl the_plots_of");
    }
}
