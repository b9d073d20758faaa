//! Carries scenarios out and reports.

use std::any::Any;
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
use super::{Case, Mistake, Rig, Scenario};

/// How long `power cycle` leaves the supply off, and how long it waits for the module to start.
const OFF: Nanos = 100 * MILLISECOND;
/// How often something is looked at that lasts or is waited for.
const GLANCE: Nanos = MILLISECOND;

/// Which scenarios are run, and how much of them.
#[derive(Clone, Copy, Debug)]
pub struct Choice<'a> {
    /// Those whose `file: title` contains this.
    pub filter: &'a str,
    /// Only the first row of each table.
    pub first_rows: bool,
    /// But for these titles, for these reasons.
    pub except: &'a [(&'a str, &'a str)],
}

/// A scenario of a file, and what has become of it.
struct Entry {
    file: String,
    title: String,
    cases: Vec<Case>,
    /// How many cases have not been run.
    left: AtomicUsize,
    /// By the number of the case.
    failures: Mutex<Vec<(usize, String)>>,
}

impl Entry {
    fn read(file: &str, title: String, scenario: Result<Scenario, Mistake>, choice: &Choice<'_>) -> Self {
        let (mut cases, failures) = match scenario {
            Ok(scenario) => (scenario.cases, Vec::new()),
            Err(mistake) => (Vec::new(), vec![(0, format!("{file}:{}: {}", mistake.line, mistake.message))]),
        };
        if choice.except.iter().any(|(other, _)| *other == title) {
            cases.clear();
        } else if choice.first_rows {
            cases.truncate(1);
        }
        let left = AtomicUsize::new(cases.len());
        Entry { file: file.into(), title, cases, left, failures: Mutex::new(failures) }
    }

    fn verdict(&self, choice: &Choice<'_>) -> String {
        let failed = self.failures.lock().unwrap().len();
        let reason = choice.except.iter().find(|(title, _)| *title == self.title);
        match (failed, self.cases.len(), reason) {
            (0, _, Some((_, reason))) => format!("left out: {reason}"),
            (0, 1, _) => "ok".into(),
            (0, cases, _) => format!("ok, {cases} cases"),
            (_, 0, _) => "cannot be read".into(),
            (failed, cases, _) => format!("FAILED, {failed} of {cases} cases"),
        }
    }
}

/// Runs the scenarios of all files in a directory that are chosen on all processors, prints a line for each in their
/// order, and gives the failures.
pub fn run_directory<R: Rig>(
    directory: &Path,
    choice: &Choice<'_>,
    rig: impl Fn(&WorldConfig) -> R + Sync,
) -> Vec<String> {
    let entries = entries(directory, choice);
    let jobs: Vec<(&Entry, usize)> =
        entries.iter().flat_map(|entry| (0..entry.cases.len()).map(move |case| (entry, case))).collect();
    let (next, told) = (AtomicUsize::new(0), Mutex::new(0));
    let work = || {
        loop {
            tell(&entries, &mut told.lock().unwrap(), choice);
            let Some((entry, index)) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) else { return };
            let case = &entry.cases[*index];
            if let Err((line, message)) = run_case(case, &rig) {
                let failure = describe(&entry.file, line, &message, case);
                entry.failures.lock().unwrap().push((*index, failure));
            }
            entry.left.fetch_sub(1, Ordering::Release);
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    tell(&entries, &mut told.lock().unwrap(), choice);
    let failures = entries.into_iter().flat_map(|entry| {
        let mut failures = entry.failures.into_inner().unwrap();
        failures.sort();
        failures
    });
    failures.map(|(_, failure)| failure).collect()
}

fn entries(directory: &Path, choice: &Choice<'_>) -> Vec<Entry> {
    let mut files: Vec<_> = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "txt"));
    files.sort();
    assert!(!files.is_empty(), "no scenario files in {}", directory.display());
    let mut entries = Vec::new();
    for path in files {
        let file = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).unwrap();
        let scenarios = document::read(&text).into_iter();
        entries.extend(scenarios.map(|(title, scenario)| Entry::read(&file, title, scenario, choice)));
    }
    for (title, _) in choice.except {
        assert!(entries.iter().any(|entry| entry.title == *title), "there is no scenario '{title}' to be left out");
    }
    entries.retain(|entry| format!("{}: {}", entry.file, entry.title).contains(choice.filter));
    entries
}

/// Prints the lines of the scenarios that are done, `told` of which have been.
fn tell(entries: &[Entry], told: &mut usize, choice: &Choice<'_>) {
    while let Some(entry) = entries.get(*told).filter(|entry| entry.left.load(Ordering::Acquire) == 0) {
        // Not `println`: the test harness would keep it to itself.
        writeln!(std::io::stdout().lock(), "{}: {} ... {}", entry.file, entry.title, entry.verdict(choice)).unwrap();
        *told += 1;
    }
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
            .unwrap_or_else(|panic| Err(format!("panicked: {}", said(&*panic))));
        result.map_err(|message| (source.number, format!("{}: {message}", source.text)))?;
    }
    Ok(())
}

/// What a panic said.
fn said(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    text.unwrap_or("nothing").into()
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
