//! The world of a virtual module: what there is to be touched in it, and what there is to be drawn.

use hal_sim::control::{Touch, Touchable, touchables};
use hal_sim::world::config::{StageConfig, WorldConfig};
use serde::{Deserialize, Serialize};
use tmcl_tools::product;
use tmcm_sim::Product;

use crate::language::{Checked, Mistake, Severity};
use crate::types::{SampleRow, Start, WorldText};

/// The parts of a world that can be touched and drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldOffers {
    /// The parts that can be touched.
    pub touchables: Vec<WorldTouchable>,
    /// The stages of the axes, axis 0 first.
    pub stages: Vec<WorldStage>,
}

/// Something that can be touched.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldTouchable {
    /// The axis whose it is; null for what is of the whole board.
    pub axis: Option<usize>,
    /// The name of the part.
    pub name: String,
    /// How it is touched.
    pub how: WorldTouch,
    /// The curve that shows how it is; null for what nothing tells.
    pub shown: Option<String>,
}

/// How something is touched: by which lines of the control port.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum WorldTouch {
    /// The part is on or off.
    Switch(WorldSwitch),
    /// The part has a number.
    Number(WorldNumber),
    /// The part is in one of several states, in the order of their numbers from 0 on.
    Choice(Vec<WorldState>),
}

/// Lines that switch something.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldSwitch {
    /// Switches it on.
    pub on: String,
    /// Switches it off.
    pub off: String,
}

/// A line with a number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldNumber {
    /// The text in front of the number.
    pub before: String,
    /// The text behind the number.
    pub behind: String,
    /// The least number.
    pub least: f64,
    /// The greatest number.
    pub greatest: f64,
    /// Numbers are multiples of it.
    pub step: f64,
    /// The unit of the number; empty if it has none.
    pub unit: String,
    /// Whether it is something that happens, and no state.
    pub once: bool,
}

/// A state, and the line for it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldState {
    /// The name of the state.
    pub name: String,
    /// The line.
    pub line: String,
}

/// A stage, in 1/256 full steps on the rotor's scale.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldStage {
    /// Length of a turn of the rotor.
    pub turn: i64,
    /// Length of the circle of a rotary stage; null for one that goes to and fro.
    pub circle: Option<i64>,
    /// The lowest position that it can reach; null if nothing blocks it.
    pub lowest: Option<i64>,
    /// The highest one.
    pub highest: Option<i64>,
    /// Where its switches are closed.
    pub zones: Vec<WorldZone>,
}

/// Positions that close a switch.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldZone {
    /// The switch.
    pub name: String,
    /// The lowest position that closes it; null if there is none.
    pub from: Option<i64>,
    /// The highest one.
    pub to: Option<i64>,
}

/// How a world is at a moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldSeen {
    /// The values that are looked at.
    pub row: SampleRow,
    /// Whether its time is paused.
    pub paused: bool,
    /// Whether paused time passes, because something was asked for that takes time.
    pub busy: bool,
    /// How fast time has been going lately, as a factor of the clock.
    pub factor: f64,
    /// How fast it is wanted to go; null if as fast as it can.
    pub wanted: Option<f64>,
    /// How many milliseconds it has fallen behind the clock since it last was paused.
    pub behind: f64,
}

/// Tells what there is in the world of a module that is started so.
///
/// # Errors
/// There is no such product, or its world or its EEPROM cannot be so.
pub fn offers(start: &Start) -> Result<WorldOffers, String> {
    let product = product::named(&start.product)?;
    let (kind, world) = (product.kind(), config(start)?);
    eeprom(start, product)?;
    let stages = (0..kind.axes()).map(|axis| {
        let axis = world.axis(axis);
        stage(&axis.stage, axis.units_per_turn())
    });
    Ok(WorldOffers { touchables: touchables(kind).into_iter().map(touchable).collect(), stages: stages.collect() })
}

/// Tells what is wrong with the text of a world, as the editor shows it: only the mistake that is found first.
///
/// # Errors
/// There is no such product.
pub fn check(WorldText { text, product }: &WorldText) -> Result<Checked, String> {
    let kind = product::named(product)?.kind();
    let messages: Vec<Mistake> =
        WorldConfig::parse_for(kind, text).err().map(|why| mistake(&why, text)).into_iter().collect();
    Ok(Checked {
        lines: Vec::new(),
        messages,
        more: None,
        commands: Vec::new(),
        labels: Vec::new(),
        used: 0,
        room: None,
    })
}

/// The mistake that is said of a world, at its place. The message of the TOML parser shows the line once more, which is
/// left out.
fn mistake(why: &str, text: &str) -> Mistake {
    let line = line_of(why).unwrap_or(0);
    let length = text.lines().nth(line).map_or(0, |line| line.encode_utf16().count());
    let start = number_behind(why, "column ").filter(|start| *start < length).unwrap_or(0);
    let is_shown_again = |line: &&str| line.contains('|') || line.starts_with("TOML parse error");
    let place = format!("line {}: ", line + 1);
    let words = why.trim_end().lines().filter(|line| !is_shown_again(line));
    let words: Vec<&str> = words.map(|line| line.strip_prefix(&place).unwrap_or(line)).collect();
    Mistake {
        file: None,
        line,
        start,
        end: length.max(start),
        severity: Severity::Error,
        words: words.join(" "),
        advice: None,
    }
}

/// The line that a message about a world speaks of, counted from 0.
fn line_of(why: &str) -> Option<usize> {
    number_behind(why, "line ")
}

/// The number behind a word, which counts from 1, counted from 0.
fn number_behind(why: &str, word: &str) -> Option<usize> {
    let (_, behind) = why.split_once(word)?;
    behind.split(|letter: char| !letter.is_ascii_digit()).next()?.parse::<usize>().ok()?.checked_sub(1)
}

/// The world that a module is started in.
///
/// # Errors
/// There is no such product, or its world cannot be so.
pub fn config(Start { product, world, .. }: &Start) -> Result<WorldConfig, String> {
    let kind = product::named(product)?.kind();
    let read = |text: &String| {
        WorldConfig::parse_for(kind, text).map_err(|error| {
            let Mistake { words, .. } = mistake(&error, text);
            line_of(&error)
                .map_or_else(|| format!("the world: {words}"), |line| format!("the world: line {}: {words}", line + 1))
        })
    };
    world.as_ref().map_or_else(|| Ok(WorldConfig::default()), read)
}

/// The contents of the EEPROM of a module that is started so; `None` as it leaves the factory.
///
/// # Errors
/// It has another size than that of this product, or is not hexadecimal.
pub fn eeprom(Start { eeprom, .. }: &Start, product: Product) -> Result<Option<Vec<u8>>, String> {
    let Some(text) = eeprom else { return Ok(None) };
    let size = product.kind().eeprom.size;
    if text.len() != 2 * size {
        let (length, name) = (text.len() / 2, product.name());
        return Err(format!("the EEPROM: there are {length} bytes, and that of a {name} has {size}"));
    }
    let digit = |byte: &u8| char::from(*byte).to_digit(16);
    let byte = |pair: &[u8]| u8::try_from(digit(pair.first()?)? << 4 | digit(pair.get(1)?)?).ok();
    let bytes: Option<Vec<u8>> = text.as_bytes().chunks(2).map(byte).collect();
    bytes.map(Some).ok_or_else(|| "the EEPROM: two hexadecimal digits stand for each byte".into())
}

/// The contents of an EEPROM as text, as [`eeprom`] reads it.
pub fn contents(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn stage(stage: &StageConfig, turn: i64) -> WorldStage {
    let zones =
        stage.zones().into_iter().map(|zone| WorldZone { name: zone.pin.name().into(), from: zone.from, to: zone.to });
    let StageConfig { circle, hard_left: lowest, hard_right: highest, .. } = *stage;
    WorldStage { turn, circle, lowest, highest, zones: zones.collect() }
}

fn touchable(Touchable { axis, name, how, shown }: Touchable) -> WorldTouchable {
    let how = match how {
        Touch::Switch { on, off } => WorldTouch::Switch(WorldSwitch { on, off }),
        Touch::Number { before, behind, least, greatest, step, unit, once } => {
            WorldTouch::Number(WorldNumber { before, behind, least, greatest, step, unit: unit.into(), once })
        }
        Touch::Choice(states) => {
            WorldTouch::Choice(states.into_iter().map(|(name, line)| WorldState { name: name.into(), line }).collect())
        }
    };
    WorldTouchable { axis, name, how, shown }
}

#[cfg(test)]
pub(crate) fn examples() -> Vec<(&'static str, serde_json::Value)> {
    use serde_json::json;
    let world = String::from("[stage]\nleft = -5\nright = 9\nhard_left = -9\nhard_right = 12\ncircle = 5\n");
    let with = offers(&Start { product: "1140".into(), world: Some(world.replace("circle = 5\n", "")), eeprom: None })
        .unwrap();
    let mut examples = Vec::new();
    let zone = |from, to| WorldZone { name: "left".into(), from, to };
    for stage in [
        with.stages[0].clone(),
        WorldStage { turn: 1, circle: Some(5), lowest: None, highest: None, zones: vec![zone(Some(1), None)] },
    ] {
        examples.push(("WorldStage", json!(stage)));
    }
    examples.push(("WorldZone", json!(zone(None, Some(1)))));
    let row = SampleRow { at: 1.0, values: vec![Some(1.0), None] };
    for wanted in [Some(1.0), None] {
        examples.push((
            "WorldSeen",
            json!(WorldSeen { row: row.clone(), paused: true, busy: false, factor: 1.0, wanted, behind: 0.5 }),
        ));
    }
    for touchable in &with.touchables {
        examples.push(("WorldTouchable", json!(touchable)));
        match &touchable.how {
            how @ WorldTouch::Switch(of) => {
                examples.push(("WorldSwitch", json!(of)));
                examples.push(("WorldTouch", json!(how)));
            }
            how @ WorldTouch::Number(of) => {
                examples.push(("WorldNumber", json!(of)));
                examples.push(("WorldTouch", json!(how)));
            }
            how @ WorldTouch::Choice(of) => {
                examples.push(("WorldState", json!(of[0])));
                examples.push(("WorldTouch", json!(how)));
            }
        }
    }
    examples.push(("WorldOffers", json!(with)));
    examples
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start(product: &str, world: &str) -> Start {
        Start { product: product.into(), world: Some(world.into()), eeprom: None }
    }

    #[test]
    fn a_stage_is_told_as_its_world_has_it() {
        let world = "[stage]\nleft = -1000\nright = 2000\nright_width = 10\nhome = [5, 9]\nhard_left = -1500\n";
        let WorldOffers { stages, touchables } = offers(&start("6110", world)).unwrap();
        assert_eq!(stages.len(), 6);
        let WorldStage { turn, circle, lowest, highest, zones } = &stages[5];
        assert_eq!((*turn, *circle, *lowest, *highest), (200 * 256, None, Some(-1500), None));
        let zones: Vec<_> = zones.iter().map(|zone| (zone.name.as_str(), zone.from, zone.to)).collect();
        assert_eq!(zones, [("left", None, Some(-1000)), ("right", Some(2000), Some(2009)), ("home", Some(5), Some(9))]);
        let left = touchables.iter().find(|one| one.axis == Some(5) && one.name == "left switch").unwrap();
        let lines = WorldSwitch { on: "press left 5".into(), off: "release left 5".into() };
        assert_eq!((&left.how, left.shown.as_deref()), (&WorldTouch::Switch(lines), Some("switches.left 5")));
        assert!(offers(&start("1140", "[motor]\nfrictoin = 1")).unwrap_err().contains("frictoin"));
        assert!(offers(&start("9999", "")).is_err());
    }

    #[test]
    fn what_is_wrong_with_a_world_has_its_place() {
        let of = |product: &str, text: &str| {
            let Checked { messages, .. } = check(&WorldText { text: text.into(), product: product.into() }).unwrap();
            messages.into_iter().map(|one| (one.line, one.start, one.end, one.words)).collect::<Vec<_>>()
        };
        assert!(of("1140", "[stage]\nleft = 5\n").is_empty());
        let [(1, 0, 9, words)] = &of("1140", "[stage]\nlefft = 1\n[motor]\n")[..] else { panic!() };
        assert!(words.starts_with("unknown field `lefft`, expected one of ") && !words.contains('|'), "{words}");
        let [(2, 0, 10, words)] = &of("1140", "[stage]\nright = 500\nleft = 500\n")[..] else { panic!() };
        assert!(words.contains("stage.left: 500 is not below stage.right (500)"), "{words}");
        let [(3, 0, _, words)] = &of("3110", "[[axis]]\n[[axis]]\n[[axis]]\n[[axis]]\n")[..] else { panic!() };
        assert!(words.contains("the TMCM-3110 has"), "{words}");
        let [(0, 8, 9, _)] = &of("1140", "[stage] =")[..] else { panic!() };
    }
}
