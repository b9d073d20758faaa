//! How much is gained: times of one run by one another, which no other load of the host changes much. `docs/figures.md`
//! has the figures.

use common::image;
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::world::config::WorldConfig;
use std::time::{Duration, Instant};
use tmcm::module::Source;
use tmcm::tmcl::{binary, text};
use tmcm_sim::image::Setup;
use tmcm_sim::{Client, ImageModule, NativeModule, VirtualModule};

/// Commands for what the motor does: nothing, and turning at 30 518 microsteps/s.
const DOES: [&str; 2] = ["MST 0", "ROR 0, 1000"];

/// The shortest of some times in which a module that does so goes on for `span`.
fn time(module: &mut impl VirtualModule, does: &str, span: Nanos) -> Duration {
    module.hear(Source::Rs485, Client::default(), &binary::encode_command(1, text::parse(does).unwrap()));
    module.run_until(module.now() + 200 * MILLISECOND);
    let mut times = [Duration::MAX; 5];
    for time in &mut times {
        let start = Instant::now();
        module.run_until(module.now() + span);
        *time = start.elapsed();
    }
    times.into_iter().min().unwrap()
}

/// How many times the time of one is that of the other.
fn ratio(one: Duration, other: Duration) -> f64 {
    one.as_secs_f64() / other.as_secs_f64()
}

#[test]
fn leaving_polls_out_is_worth_it() {
    for (does, least) in DOES.into_iter().zip([10.0, 5.0]) {
        let [with, without] = [true, false].map(|skips| {
            let mut module = NativeModule::new(&WorldConfig::default(), None, 1);
            module.skip(skips);
            time(&mut module, does, 20 * SECOND)
        });
        let ratio = ratio(without, with);
        println!("{does}: {ratio:.0} times as fast as with all polls");
        assert!(ratio > least, "{does}: {ratio}");
    }
}

#[test]
fn the_image_is_slower_than_the_core() {
    let elf = std::fs::read(image::image()).unwrap();
    for (does, least) in DOES.into_iter().zip([20.0, 20.0]) {
        let span = 100 * MILLISECOND;
        let mut module = NativeModule::new(&WorldConfig::default(), None, 1);
        module.skip(false);
        let core = time(&mut module, does, span);
        let mut module = ImageModule::new(&elf, &WorldConfig::default(), None, 1, Setup::default()).unwrap();
        let ratio = ratio(time(&mut module, does, span), core);
        assert_eq!(module.stopped(), None);
        println!("{does}: the core, with all polls, is {ratio:.0} times as fast as the image");
        assert!(ratio > least, "{does}: {ratio}");
    }
}
