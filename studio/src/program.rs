//! Programs in a module: loaded, run, read back, and followed step by step.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tmcl_tools::asm::{Settings, assemble_file};
use tmcl_tools::debug::state::{Reading, Registers, Row, RunState, Stop, View};
use tmcl_tools::debug::{self, Action, Around, Debugger, Trouble};
use tmcl_tools::disasm::source;
use tmcl_tools::dump;
use tmcl_tools::failure::Failure;
use tmcl_tools::product::{numbers, with_unit};
use tmcl_tools::program::{Program, There, Transfer, fits, is_readable, there, transfer, verify};
use tmcl_tools::progress::Progress;
use tmcl_tools::sources::Texts;
use tmcm::tmcl::Opcode;

use crate::tools::{Tools, failed};
use crate::types::{Line, Nothing, Text};

/// A text of the user.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedText {
    /// The name of the text, by which others include it.
    pub name: String,
    /// The text.
    pub text: String,
}

/// A program: a text, and those that it may include.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sources {
    /// All texts.
    pub texts: Vec<NamedText>,
    /// The name of the one with which the program begins.
    pub main: String,
}

/// A program that is to be loaded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// The program.
    pub program: Sources,
    /// Whether it is read back and compared.
    pub verify: bool,
    /// Whether it is started.
    pub run: bool,
    /// Whether the module is to start it by itself after power-up (global parameter 77).
    pub autostart: bool,
}

/// An order to a program in the module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Control {
    /// The order.
    pub what: What,
}

/// The orders that a program can be given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum What {
    /// Go on from where it is.
    Run,
    /// Stop where it is.
    Stop,
    /// Go back to its beginning.
    Reset,
}

/// The contents of a module that are in the way of a program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InTheWay {
    /// Whether the module has exactly this program already.
    pub same: bool,
    /// The losses that loading the program would cause, in words; null if there were none.
    pub lost: Option<String>,
}

/// A place in a text. Lines count from 0.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InText {
    /// The name of the text; null for the one with which the program begins.
    pub file: Option<String>,
    /// The line.
    pub line: usize,
}

/// Something with a name, and what it is now, both for people.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedValue {
    /// The name, as it can be typed.
    pub name: String,
    /// The value with its unit.
    pub value: String,
}

/// A breakpoint.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Breakpoint {
    /// The address of its command.
    pub address: u16,
    /// Where that stands; null for one that is in no text.
    pub place: Option<InText>,
    /// When it halts the program; empty for always.
    pub condition: String,
}

/// The outcome of an action of the debugger, and all that is to be seen then.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Debugged {
    /// The outcome in words, as `tmcl debug` says it.
    pub text: String,
    /// Whether the program runs freely.
    pub running: bool,
    /// Whether the last step has ended it.
    pub ended: bool,
    /// Where the next command stands, or the one that has ended the program.
    pub next: Option<InText>,
    /// The registers.
    pub registers: Vec<NamedValue>,
    /// The user variables that the program uses.
    pub variables: Vec<NamedValue>,
    /// The values that are watched.
    pub watched: Vec<NamedValue>,
    /// The breakpoints.
    pub breakpoints: Vec<Breakpoint>,
}

impl Tools {
    fn assembled(&mut self, Sources { texts, main }: &Sources) -> Result<(Program, Vec<String>), Failure> {
        let settings = Settings { product: self.module.product().map_err(failed)?, ..Settings::default() };
        let texts = texts.iter().map(|NamedText { name, text }| (PathBuf::from(name), text.clone()));
        let assembly = assemble_file(&Texts(texts.collect()), Path::new(main), settings).result;
        let assembly = assembly.map_err(|mistakes| Failure::Failed(mistakes.to_string()))?;
        let program = Program::from(assembly);
        let warning = fits(&program, settings)?;
        Ok((program, warning.into_iter().collect()))
    }

    /// Tells what the module has where a program is to go.
    ///
    /// # Errors
    /// The program has mistakes, the link fails, or it has been asked to end.
    pub fn in_the_way(
        &mut self,
        program: &Sources,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<InTheWay, Failure> {
        let (program, _) = self.assembled(program)?;
        let lost = match there(&mut self.module, &program, 0, &self.stop, progress)? {
            There::Same => return Ok(InTheWay { same: true, lost: None }),
            There::Nothing => None,
            There::Other { address, found } => Some(format!(
                "the program in the module, which differs from address {address} on: there it has {found}"
            )),
            There::Unknown => Some(
                "the program in the module, which is protected from being read (global parameter 81), so that nobody can \
                 tell what it is"
                    .into(),
            ),
        };
        Ok(InTheWay { same: false, lost })
    }

    /// Assembles a program, puts it into the module, and gives it to the debugger.
    ///
    /// # Errors
    /// The program has mistakes, the module does not take it, or it has been asked to end.
    pub fn load(
        &mut self,
        Load { program: sources, verify, run, autostart }: &Load,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Text, Failure> {
        let (program, mut lines) = self.assembled(sources)?;
        self.debugger = None;
        let wanted = Transfer { at: 0, verify: *verify, autostart: *autostart, run: *run };
        transfer(&mut self.module, &program, wanted, &self.stop, progress, |done| {
            lines.push(done.to_string());
            Ok::<_, Failure>(())
        })?;
        self.debug(&sources.main, program)?;
        Ok(Text { text: lines.join("\n"), done: true })
    }

    /// Gives a program to the debugger that is in the module already.
    ///
    /// # Errors
    /// The module has another program, or none can tell.
    pub fn attach(&mut self, sources: &Sources, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Debugged, Failure> {
        let (program, _) = self.assembled(sources)?;
        verify(&mut self.module, &program, 0, &self.stop, progress)?;
        self.debug(&sources.main, program)?;
        self.look(String::new())
    }

    fn debug(&mut self, main: &str, program: Program) -> Result<(), Failure> {
        self.debugger = Some(Debugger::new(&mut self.module, main.into(), program).map_err(failed)?);
        Ok(())
    }

    /// Carries a line of the debugger out.
    ///
    /// # Errors
    /// No program has been loaded, the line is none, it cannot be carried out, or the link fails.
    pub fn act(&mut self, Line { line }: &Line, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Debugged, Failure> {
        let debugger = self.debugger.as_mut().ok_or_else(not_loaded)?;
        let action = Action::parse(line).map_err(Failure::Failed)?;
        let mut read = |_: &Path, _| Err("load the program again by its button".into());
        let mut around = Around { stop: &self.stop, read: &mut read, progress };
        let told = debugger.act(&mut self.module, action, &mut around).map_err(trouble)?;
        let text = debug::words::text(&told);
        let lines = [text].into_iter().filter(|text| !text.is_empty()).chain(debug::words::changes(&told));
        let text = lines.collect::<Vec<_>>().join("\n");
        self.look(text)
    }

    /// Tells what there is to be seen of the program that is debugged.
    ///
    /// # Errors
    /// No program has been loaded, or the link fails.
    pub fn see(&mut self, Nothing {}: Nothing) -> Result<Debugged, Failure> {
        self.look(String::new())
    }

    fn look(&mut self, text: String) -> Result<Debugged, Failure> {
        let debugger = self.debugger.as_mut().ok_or_else(not_loaded)?;
        let View { registers, variables, watched, breakpoints, next, ended } =
            debugger.view(&mut self.module).map_err(failed)?;
        Ok(Debugged {
            text,
            running: registers.state.program == RunState::Running,
            ended,
            next: next.as_ref().and_then(in_text),
            registers: named_registers(&registers),
            variables: variables.into_iter().map(named).collect(),
            watched: watched.into_iter().map(named).collect(),
            breakpoints: breakpoints.into_iter().map(breakpoint).collect(),
        })
    }

    /// Runs the program in the module, stops it, or brings it back to its beginning.
    ///
    /// # Errors
    /// The module does not answer, or refuses that.
    pub fn control(&mut self, control: Control) -> Result<Nothing, Failure> {
        let opcode = match control.what {
            What::Run => Opcode::RunApplication,
            What::Stop => Opcode::StopApplication,
            What::Reset => Opcode::ResetApplication,
        };
        self.module.control(opcode, 0, 0).map_err(failed)?;
        Ok(Nothing {})
    }

    /// The program in the module, as a text that assembles to the same commands.
    ///
    /// # Errors
    /// It is protected from being read, the link fails, or it has been asked to end.
    pub fn read_back(&mut self, Nothing {}: Nothing, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Text, Failure> {
        if !is_readable(&mut self.module).map_err(failed)? {
            let message = "the program in the module is protected from being read (global parameter 81)";
            return Err(Failure::Failed(message.into()));
        }
        let identity = self.module.identity().map_err(failed)?;
        let room = numbers(identity.product).commands;
        let mut commands = dump::read(&mut self.module, 0..usize::from(room), &self.stop, progress)?;
        dump::trim(&mut commands);
        let text = dump::heading(&commands, 0, identity) + &source(&commands, 0, identity.product);
        Ok(Text { text, done: true })
    }
}

fn not_loaded() -> Failure {
    Failure::Failed("no program is being debugged: load one first".into())
}

fn trouble(trouble: Trouble) -> Failure {
    match trouble {
        Trouble::Mistake(message) => Failure::Failed(message),
        Trouble::Failure(failure) => failure,
    }
}

fn named(reading: Reading) -> NamedValue {
    let Reading { of, value, unit, .. } = reading;
    let value = i32::try_from(value).map_or_else(|_| value.to_string(), |value| with_unit(value, unit));
    NamedValue { name: of, value }
}

fn named_registers(Registers { state, accumulator, x, positions }: &Registers) -> Vec<NamedValue> {
    let value = |name: &str, value: String| NamedValue { name: name.into(), value };
    let mut registers =
        vec![value("pc", state.counter.to_string()), value("acc", accumulator.to_string()), value("x", x.to_string())];
    let positions = positions.iter().enumerate();
    registers.extend(positions.map(|(axis, position)| value(&format!("position {axis}"), position.to_string())));
    registers
}

fn in_text(row: &Row) -> Option<InText> {
    let (file, line) = row.line.as_ref()?.place();
    Some(InText { file: file.map(String::from), line: line.saturating_sub(1) })
}

fn breakpoint(Stop { row, condition }: Stop) -> Breakpoint {
    Breakpoint { address: row.address, place: in_text(&row), condition: condition.unwrap_or_default() }
}

#[cfg(test)]
pub(crate) fn examples() -> Vec<(&'static str, serde_json::Value)> {
    use serde_json::json;
    let text = NamedText { name: "a.tmc".into(), text: "STOP".into() };
    let program = Sources { texts: vec![text.clone()], main: "a.tmc".into() };
    let place = InText { file: Some("b.inc".into()), line: 3 };
    let value = NamedValue { name: "acc".into(), value: "5".into() };
    let breakpoint = Breakpoint { address: 7, place: Some(place.clone()), condition: "acc > 5".into() };
    let load = Load { program: program.clone(), verify: true, run: false, autostart: true };
    let debugged = Debugged {
        text: String::new(),
        running: false,
        ended: false,
        next: Some(place.clone()),
        registers: vec![value.clone()],
        variables: vec![value.clone()],
        watched: vec![value.clone()],
        breakpoints: vec![breakpoint.clone()],
    };
    vec![
        ("NamedText", json!(text)),
        ("Sources", json!(program)),
        ("Load", json!(load)),
        ("Control", json!(Control { what: What::Run })),
        ("Control", json!(Control { what: What::Stop })),
        ("Control", json!(Control { what: What::Reset })),
        ("InTheWay", json!(InTheWay { same: false, lost: Some("a program".into()) })),
        ("InTheWay", json!(InTheWay { same: true, lost: None })),
        ("InText", json!(place)),
        ("InText", json!(InText { file: None, line: 0 })),
        ("NamedValue", json!(value)),
        ("Breakpoint", json!(breakpoint)),
        ("Breakpoint", json!(Breakpoint { place: None, ..breakpoint })),
        ("Debugged", json!(debugged)),
        ("Debugged", json!(Debugged { next: None, ..debugged })),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tools::tests::tools;

    fn sources(text: &str) -> Sources {
        let texts = [("main.tmc", text), ("speeds.inc", "Slow = 100\n")];
        let texts = texts.map(|(name, text)| NamedText { name: name.into(), text: text.into() });
        Sources { texts: texts.into(), main: "main.tmc".into() }
    }

    fn load(text: &str) -> Load {
        Load { program: sources(text), verify: true, run: false, autostart: false }
    }

    const COUNT: &str = "#include speeds.inc\nCount = 4\nLoop: CALC ADD, Slow\nAGP Count, 2\nJA Loop\n";

    #[test]
    fn a_program_is_followed_step_by_step() {
        let mut tools = tools("1140");
        let mut none = |_: Progress<'_>| {};
        let act = |tools: &mut Tools, line: &str| tools.act(&Line { line: line.into() }, &mut |_| {});
        assert!(act(&mut tools, "step").unwrap_err().to_string().contains("load one first"));
        let way = tools.in_the_way(&sources(COUNT), &mut none).unwrap();
        assert_eq!(way, InTheWay { same: false, lost: None });
        let told = tools.load(&load(COUNT), &mut none).unwrap().text;
        assert_eq!(told, "loaded to addresses 0 to 3\nthe module has them as they are in the file");
        assert!(tools.in_the_way(&sources(COUNT), &mut none).unwrap().same);
        let other = tools.in_the_way(&sources("ROR 0, 5"), &mut none).unwrap();
        assert!(other.lost.unwrap().ends_with("from address 0 on: there it has CALC ADD, 100"));

        act(&mut tools, "watch acc").unwrap();
        act(&mut tools, "break :5 if acc > 150").unwrap();
        let at = act(&mut tools, "continue").unwrap();
        assert_eq!(at.next, Some(InText { file: None, line: 4 }));
        let value = |name: &str, value: &str| NamedValue { name: name.into(), value: value.into() };
        assert!(at.registers.contains(&value("acc", "200")) && at.registers.contains(&value("pc", "2")));
        assert_eq!((at.variables, at.watched), (vec![value("Count", "200")], vec![value("acc", "200")]));
        assert_eq!(at.breakpoints[0].condition, "acc > 150");
        assert!(at.text.starts_with("breakpoint\n") && at.text.ends_with("acc = 200, before 0"), "{}", at.text);
        assert!(act(&mut tools, "dance").unwrap_err().to_string().contains("dance"));

        // Attached again, it begins without breakpoints where it is.
        let at = tools.attach(&sources(COUNT), &mut none).unwrap();
        assert_eq!((at.next.map(|place| place.line), at.breakpoints.len()), (Some(4), 0));
        assert!(tools.attach(&sources("STOP"), &mut none).unwrap_err().to_string().contains("1 of 1 commands differ"));
    }

    /// A program that is read back assembles to the commands that are there.
    #[test]
    fn what_is_read_back_is_the_same_program() {
        let mut tools = tools("6110");
        tools.load(&load(COUNT), &mut |_| {}).unwrap();
        let text = tools.read_back(Nothing {}, &mut |_| {}).unwrap().text;
        assert!(text.starts_with("// TMCM-6110") && text.contains("JA L0"), "{text}");
        assert!(tools.in_the_way(&sources(&text), &mut |_| {}).unwrap().same);
    }

    #[test]
    fn what_does_not_assemble_changes_nothing() {
        let mut tools = tools("1140");
        tools.load(&load(COUNT), &mut |_| {}).unwrap();
        let told = tools.load(&load("ROR 0, Sped"), &mut |_| {}).unwrap_err().to_string();
        assert!(told.starts_with("main.tmc:1:8: error: unknown name 'Sped'"), "{told}");
        let told = tools.load(&load("#include none.inc"), &mut |_| {}).unwrap_err().to_string();
        assert!(told.contains("none.inc"), "{told}");
        assert!(tools.in_the_way(&sources(COUNT), &mut |_| {}).unwrap().same);
        assert!(tools.act(&Line { line: "step".into() }, &mut |_| {}).is_ok(), "the debugger still has it");
    }
}
