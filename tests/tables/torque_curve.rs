//! `docs/torque.svg` is drawn from the model of the default motor.

use std::fmt::Write;

use hal_sim::board::TMCM_1140;
use hal_sim::world::config::WorldConfig;
use hal_sim::world::motor::FULL_TORQUE;

use common::pages::compare;

/// The place of the curves in the image, in pixels.
const LEFT: f64 = 60.0;
const TOP: f64 = 50.0;
const WIDTH: f64 = 700.0;
const HEIGHT: f64 = 300.0;
/// The fastest motor of the image, in rpm.
const FASTEST: f64 = 5_000.0;
/// The supply voltages, each with the colour of its curve.
const SUPPLIES: [(f64, &str); 3] = [(12.0, "#b35900"), (18.0, "#5b6b7a"), (24.0, "#1f6fb2")];

fn x(rpm: f64) -> f64 {
    LEFT + rpm / FASTEST * WIDTH
}

/// The height of a share of the torque at full current.
fn y(share: f64) -> f64 {
    TOP + (1.0 - share) * HEIGHT
}

/// The path of a curve of shares over the speed in full steps per second.
fn path(share: impl Fn(f64) -> f64) -> String {
    let speeds = (0..=250).map(|number| f64::from(number) / 250.0 * FASTEST);
    let mut path = String::new();
    for rpm in speeds {
        let letter = if path.is_empty() { 'M' } else { 'L' };
        write!(path, "{letter}{:.1} {:.1}", x(rpm), y(share(rpm / 60.0 * 200.0))).unwrap();
    }
    path
}

fn image() -> String {
    let motor = WorldConfig::default().every.motor(&TMCM_1140);
    let winding = motor.winding.unwrap();
    let mut image = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 800 410\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"800\" height=\"410\" fill=\"#fff\"/>\n\
         <text x=\"{LEFT}\" y=\"28\" font-size=\"17\" font-weight=\"bold\">Torque of the default motor at a TMCM-1140</text>\n"
    );
    for tenth in (0..=10).step_by(2) {
        let (share, height) = (f64::from(tenth) / 10.0, y(f64::from(tenth) / 10.0));
        writeln!(image, "<path d=\"M{LEFT} {height:.1}H{}\" stroke=\"#ddd\"/>", LEFT + WIDTH).unwrap();
        writeln!(image, "<text x=\"52\" y=\"{:.1}\" text-anchor=\"end\">{share:.1}</text>", height + 4.0).unwrap();
    }
    for rpm in (0..=5).map(|number| f64::from(number) * 1_000.0) {
        writeln!(image, "<path d=\"M{:.1} {TOP}V{}\" stroke=\"#ddd\"/>", x(rpm), TOP + HEIGHT).unwrap();
        writeln!(image, "<text x=\"{:.1}\" y=\"368\" text-anchor=\"middle\">{rpm}</text>", x(rpm)).unwrap();
    }
    let texts = [(LEFT, 388.0, "speed in rpm"), (LEFT, 44.0, "share of the torque at full current")];
    for (x, y, text) in texts {
        writeln!(image, "<text x=\"{x}\" y=\"{y}\" fill=\"#666\">{text}</text>").unwrap();
    }
    for (number, (volts, colour)) in (0..).zip(SUPPLIES) {
        let share = |speed: f64| (f64::from(winding.torque(volts, speed)) / f64::from(FULL_TORQUE)).min(1.0);
        writeln!(image, "<path d=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>", path(share)).unwrap();
        let at = 100.0 + 22.0 * f64::from(number);
        writeln!(image, "<text x=\"640\" y=\"{at}\" fill=\"{colour}\">{volts} V</text>").unwrap();
    }
    let drag = |speed: f64| f64::from(motor.drag) / f64::from(FULL_TORQUE) * speed / 1_000.0;
    let dashed = "stroke=\"#333\" stroke-dasharray=\"6 4\"";
    writeln!(image, "<path d=\"{}\" fill=\"none\" {dashed}/>", path(drag)).unwrap();
    writeln!(image, "<text x=\"640\" y=\"166\" fill=\"#333\">drag (dashed)</text>").unwrap();
    image + "</svg>\n"
}

#[test]
fn the_curve_in_the_docs_is_that_of_the_model() {
    compare("torque.svg", "--test tables torque_curve", &image());
}
