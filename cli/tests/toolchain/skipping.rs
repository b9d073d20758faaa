//! All scenarios of `tests/scenarios`, on two modules at once.

use std::fmt::Debug;

use hal_sim::clock::Nanos;
use hal_sim::control::Line;
use tmcl_cli::testing;
use tmcm::can::Frame;
use tmcm::tmcl::Command;
use tmcm_sim::look::Look;
use tmcm_sim::scenario::suite::{self, Report, Start};
use tmcm_sim::scenario::{Case, Rig, Stand};
use tmcm_sim::{Model, NativeModule};

use common::pair::seen;

/// The modules, each with its hosts; the first one leaves polls out.
struct Twins([Stand<NativeModule>; 2]);

impl Twins {
    fn of(case: &Case) -> Self {
        Twins([true, false].map(|skips| {
            let mut stand = Stand::native(case);
            let module = stand.module_mut();
            module.skip(skips);
            module.trace(true);
            stand
        }))
    }

    /// The result of an act on both, which is the same, as is what can be seen of them afterwards.
    fn both<T: PartialEq + Debug>(&mut self, mut act: impl FnMut(&mut Stand<NativeModule>) -> T) -> T {
        let [with, without] = self.0.each_mut().map(|stand| (act(stand), seen(stand.module_mut())));
        assert!(with == without, "{with:?}\ninstead of {without:?}");
        with.0
    }
}

impl Rig for Twins {
    fn send(&mut self, command: Command) -> Option<(u8, i32)> {
        self.both(|stand| stand.send(command))
    }

    fn post(&mut self, command: Command) {
        self.both(|stand| stand.post(command));
    }

    fn control(&mut self, line: &Line) -> Result<(), String> {
        self.both(|stand| stand.control(line))
    }

    fn control_at(&mut self, delay: Nanos, line: &Line) -> Result<(), String> {
        self.both(|stand| stand.control_at(delay, line))
    }

    fn look(&mut self, look: &Look) -> f64 {
        self.0[0].look(look)
    }

    fn now(&mut self) -> Nanos {
        self.0[0].now()
    }

    fn pass(&mut self, span: Nanos) {
        self.both(|stand| stand.pass(span));
    }

    fn send_frame(&mut self, frame: Frame) {
        self.both(|stand| stand.send_frame(frame));
    }

    fn frame(&mut self) -> Option<Frame> {
        self.both(Stand::frame)
    }

    fn stopped(&self) -> Option<String> {
        self.0[0].stopped()
    }
}

#[test]
fn have_the_same_outcome() {
    let folder = xtask::workspace().unwrap().join("tests/scenarios");
    let paths = testing::expanded(&folder).unwrap();
    let files: Vec<_> = paths.iter().map(|path| testing::read_file(path, Model::default(), "").unwrap()).collect();
    assert!(files.len() > 10);
    let reports = suite::run(&files, |case| Start::Ready(Twins::of(case)), |_| ());
    let failures: Vec<String> = reports.iter().flat_map(Report::failures).collect();
    assert!(failures.is_empty(), "{} failed:\n{}", failures.len(), failures.join("\n"));
}
