//! Carries scenarios out and reports.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::control::Line;
use hal_sim::world::config::WorldConfig;
use tmcm::tmcl::text;

use super::document;
use super::line::{Answer, Condition, Relation, Step, Sum, Template, Term};
use super::{Case, Rig};

/// How long `power cycle` leaves the supply off, and how long it waits for the module to start.
const OFF: Nanos = 100 * MILLISECOND;
/// How often something is looked at that lasts or is waited for.
const GLANCE: Nanos = MILLISECOND;

/// Runs the scenarios of all files in a directory whose `file: title` contains `filter`, prints a line for each,
/// and gives the failures.
pub fn run_directory<R: Rig>(directory: &Path, filter: &str, rig: impl Fn(&WorldConfig) -> R + Sync) -> Vec<String> {
    let mut files: Vec<_> = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "txt"));
    files.sort();
    assert!(!files.is_empty(), "no scenario files in {}", directory.display());
    let mut failures = Vec::new();
    for path in files {
        let file = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).unwrap();
        for (title, scenario) in document::read(&text) {
            let name = format!("{file}: {title}");
            if !name.contains(filter) {
                continue;
            }
            let (cases, failed) = match scenario {
                Ok(scenario) => (scenario.cases.len(), run_cases(&file, &scenario.cases, &rig)),
                Err(mistake) => (0, vec![format!("{file}:{}: {}", mistake.line, mistake.message)]),
            };
            let verdict = match (failed.len(), cases) {
                (0, 1) => "ok".into(),
                (0, cases) => format!("ok, {cases} cases"),
                (_, 0) => "cannot be read".into(),
                (failed, cases) => format!("FAILED, {failed} of {cases} cases"),
            };
            // Not `println`: the test harness would keep it to itself.
            let mut out = std::io::stdout().lock();
            writeln!(out, "{name} ... {verdict}").unwrap();
            failures.extend(failed);
        }
    }
    failures
}

/// Runs the cases of a scenario on all processors and gives the failures in the order of the cases.
fn run_cases<R: Rig>(file: &str, cases: &[Case], rig: &(impl Fn(&WorldConfig) -> R + Sync)) -> Vec<String> {
    let next = AtomicUsize::new(0);
    let failures = Mutex::new(Vec::new());
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(cases.len());
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(case) = cases.get(index) else { return };
                    if let Err((line, message)) = run_case(case, rig) {
                        failures.lock().unwrap().push((index, describe(file, line, &message, case)));
                    }
                }
            });
        }
    });
    let mut failures = failures.into_inner().unwrap();
    failures.sort();
    failures.into_iter().map(|(_, failure)| failure).collect()
}

fn describe(file: &str, line: usize, message: &str, case: &Case) -> String {
    let mut text = format!("{file}:{line}: {message}");
    if !case.label.is_empty() {
        write!(text, " (case: {})", case.label).unwrap();
    }
    text
}

/// Runs one case. The error says in which line it failed and how.
pub(super) fn run_case<R: Rig>(case: &Case, rig: &impl Fn(&WorldConfig) -> R) -> Result<(), (usize, String)> {
    let mut runner = Runner { rig: rig(&case.world), remembered: HashMap::new() };
    for (source, step) in &case.steps {
        let result = catch_unwind(AssertUnwindSafe(|| runner.step(step)))
            .unwrap_or_else(|_| Err("the module's software panicked".into()));
        result.map_err(|message| (source.number, format!("{}: {message}", source.text)))?;
    }
    Ok(())
}

struct Runner<R> {
    rig: R,
    remembered: HashMap<String, i64>,
}

impl<R: Rig> Runner<R> {
    fn step(&mut self, step: &Step) -> Result<(), String> {
        match step {
            Step::Command { command, answer } => return self.command(command, answer),
            Step::Expect { condition, hold } => return self.expect(condition, *hold),
            Step::Wait { span, until: None } => self.rig.pass(*span),
            Step::Wait { span, until: Some(condition) } => return self.wait(*span, condition),
            Step::Let { name, value } => {
                let value = self.sum(value)?;
                self.remembered.insert(name.clone(), value);
            }
            Step::Control(line) => self.rig.control(line),
            Step::PowerCycle => {
                for state in ["power off", "power on"] {
                    self.rig.control(&Line::parse(state)?);
                    self.rig.pass(OFF);
                }
            }
        }
        Ok(())
    }

    fn now(&mut self) -> Nanos {
        self.rig.state().time_us * MICROSECOND
    }

    fn command(&mut self, command: &Template, answer: &Answer) -> Result<(), String> {
        let reply = self.send(command)?;
        let Answer::Status { status: wanted, value: wanted_value } = answer else {
            let why = |(status, value)| format!("answered status {status}, value {value}");
            return reply.map_or(Ok(()), |reply| Err(why(reply)));
        };
        let Some((status, value)) = reply else { return Err("no reply".into()) };
        if status != *wanted {
            return Err(format!("answered status {status}"));
        }
        if let Some(wanted) = wanted_value
            && self.sum(wanted)? != i64::from(value)
        {
            return Err(format!("answered value {value}"));
        }
        Ok(())
    }

    fn expect(&mut self, condition: &Condition, hold: Nanos) -> Result<(), String> {
        let end = self.now() + hold;
        loop {
            if let Some(why) = self.violated(condition)? {
                return Err(why);
            }
            if self.now() >= end {
                return Ok(());
            }
            self.rig.pass(GLANCE);
        }
    }

    fn wait(&mut self, limit: Nanos, condition: &Condition) -> Result<(), String> {
        let end = self.now() + limit;
        while let Some(why) = self.violated(condition)? {
            if self.now() >= end {
                return Err(format!("not in this time: {why}"));
            }
            self.rig.pass(GLANCE);
        }
        Ok(())
    }

    /// What the values are if the condition is not met.
    fn violated(&mut self, condition: &Condition) -> Result<Option<String>, String> {
        let left = self.sum(&condition.left)?;
        let (met, right) = match &condition.relation {
            Relation::Near(right, tolerance) => {
                let (right, tolerance) = (self.sum(right)?, self.sum(tolerance)?);
                ((left - right).abs() <= tolerance, right)
            }
            Relation::Not(right) => self.compare(right, |right| left != right)?,
            Relation::Below(right) => self.compare(right, |right| left < right)?,
            Relation::UpTo(right) => self.compare(right, |right| left <= right)?,
            Relation::Above(right) => self.compare(right, |right| left > right)?,
            Relation::From(right) => self.compare(right, |right| left >= right)?,
            Relation::Between(low, high) => {
                let (low, high) = (self.sum(low)?, self.sum(high)?);
                let met = (low..=high).contains(&left);
                return Ok((!met).then(|| format!("the left side is {left}, the others are {low} and {high}")));
            }
        };
        Ok((!met).then(|| format!("the left side is {left}, the right side {right}")))
    }

    fn compare(&mut self, right: &Sum, relation: impl Fn(i64) -> bool) -> Result<(bool, i64), String> {
        let right = self.sum(right)?;
        Ok((relation(right), right))
    }

    fn sum(&mut self, sum: &Sum) -> Result<i64, String> {
        let mut total = 0;
        for (subtract, term) in sum {
            let value = self.term(term)?;
            total += if *subtract { -value } else { value };
        }
        Ok(total)
    }

    fn term(&mut self, term: &Term) -> Result<i64, String> {
        match term {
            Term::Number(number) => Ok(*number),
            Term::Remembered(name) => self.remembered.get(name).copied().ok_or(format!("'${name}' has no value")),
            Term::World(read) => Ok(read(&self.rig.state())),
            Term::Read(template) => match self.send(template)? {
                Some((100, value)) => Ok(value.into()),
                Some((status, _)) => Err(format!("{} answered status {status}", template.name)),
                None => Err(format!("{}: no reply", template.name)),
            },
        }
    }

    fn send(&mut self, template: &Template) -> Result<Option<(u8, i32)>, String> {
        let line = template.filled(|sum| self.sum(sum))?;
        let command = text::parse(&line).map_err(|error| error.to_string())?;
        Ok(self.rig.send(command))
    }
}
