//! Runs the scenarios of many files on all processors, and keeps what has become of each case.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::run::said;
use super::{Case, Mistake, Rig, Scenario, run_case};

/// The scenarios of a file.
#[derive(Clone, Debug)]
pub struct File {
    /// The file's name, as messages show it.
    pub name: String,
    /// The scenarios that [`read`](super::read) has found in it.
    pub scenarios: Vec<Scenario>,
}

/// The beginning of a case.
#[derive(Debug)]
pub enum Start<R> {
    /// The module is ready.
    Ready(R),
    /// The case is left out, for this reason.
    LeftOut(String),
    /// The module cannot start, for this reason.
    Failed(String),
}

/// The outcome of a case.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All steps did what they say.
    Passed,
    /// A step did not, or cannot be understood.
    Failed(Mistake),
    /// The case was left out, for this reason.
    LeftOut(String),
}

/// A case that is done: a row of a scenario's tables.
#[derive(Clone, Debug)]
pub struct Row {
    /// The parameters and their values; empty if the scenario has none.
    pub label: String,
    /// The outcome of the case.
    pub outcome: Outcome,
    /// The time that it took.
    pub took: Duration,
}

/// A scenario whose cases are done.
#[derive(Clone, Debug)]
pub struct Report {
    /// The name of its file.
    pub file: String,
    /// The line of its title.
    pub line: usize,
    /// The title of the scenario.
    pub title: String,
    /// The cases of the scenario, in the order of its tables; for a scenario that cannot be read a single one, which
    /// says why.
    pub rows: Vec<Row>,
}

/// News of a run.
#[derive(Debug)]
pub enum News<'a> {
    /// So many of all cases are done.
    Cases(usize, usize),
    /// A scenario is done. Scenarios are told of in the order of the files.
    Scenario(&'a Report),
}

impl Report {
    /// The failures, each in a line with file, line, step, and the parameters of the case.
    pub fn failures(&self) -> impl Iterator<Item = String> {
        self.rows.iter().filter_map(|row| {
            let Outcome::Failed(mistake) = &row.outcome else { return None };
            let case = if row.label.is_empty() { String::new() } else { format!(" (case: {})", row.label) };
            Some(format!("{}:{}: {}{case}", self.file, mistake.line, mistake.message))
        })
    }

    /// The outcome of the scenario, in a few words.
    pub fn verdict(&self) -> String {
        let count = |wanted: fn(&Outcome) -> bool| self.rows.iter().filter(|row| wanted(&row.outcome)).count();
        let failed = count(|outcome| matches!(outcome, Outcome::Failed(_)));
        let left_out = count(|outcome| matches!(outcome, Outcome::LeftOut(_)));
        let reason = self.rows.iter().find_map(|row| match &row.outcome {
            Outcome::LeftOut(reason) => Some(reason.as_str()),
            _ => None,
        });
        let total = self.rows.len();
        match (failed, reason) {
            (0, Some(reason)) if left_out == total => format!("left out: {reason}"),
            (0, Some(reason)) => {
                format!("ok, {} of {total} cases; the others are left out: {reason}", total - left_out)
            }
            (0, None) if total == 1 => "ok".into(),
            (0, None) => format!("ok, {total} cases"),
            (_, _) if total == 1 => "FAILED".into(),
            (failed, _) => format!("FAILED, {failed} of {total} cases"),
        }
    }
}

/// A scenario while its cases run.
struct Entry<'a> {
    file: &'a str,
    scenario: &'a Scenario,
    rows: Vec<Option<Row>>,
}

impl Entry<'_> {
    fn report(&self) -> Option<Report> {
        let rows = self.rows.iter().cloned().collect::<Option<Vec<Row>>>()?;
        Some(Report { file: self.file.into(), line: self.scenario.line, title: self.scenario.title.clone(), rows })
    }
}

/// The data that the threads share.
struct Shared<'a, T> {
    entries: VecDeque<Entry<'a>>,
    /// Scenario and case of those that have not begun.
    waiting: VecDeque<(usize, usize, &'a Case)>,
    reports: Vec<Report>,
    done: usize,
    total: usize,
    tell: T,
}

impl<T: FnMut(News<'_>)> Shared<'_, T> {
    /// Tells of the scenarios that are done, up to the first that is not.
    fn report(&mut self) {
        while let Some(report) = self.entries.front().and_then(Entry::report) {
            self.entries.pop_front();
            (self.tell)(News::Scenario(&report));
            self.reports.push(report);
        }
    }
}

/// Runs all cases of all scenarios, as many at a time as there are processors, each on a module that `start` makes, and
/// gives what has become of them. `tell` hears how it goes on.
pub fn run<R: Rig>(
    files: &[File],
    start: impl Fn(&Case) -> Start<R> + Sync,
    tell: impl FnMut(News<'_>) + Send,
) -> Vec<Report> {
    let mut shared =
        Shared { entries: VecDeque::new(), waiting: VecDeque::new(), reports: Vec::new(), done: 0, total: 0, tell };
    for (file, scenario) in files.iter().flat_map(|file| file.scenarios.iter().map(|scenario| (&file.name, scenario))) {
        let index = shared.entries.len();
        let rows = match &scenario.cases {
            Ok(cases) => {
                shared.waiting.extend(cases.iter().enumerate().map(|(number, case)| (index, number, case)));
                vec![None; cases.len()]
            }
            Err(mistake) => {
                let outcome = Outcome::Failed(mistake.clone());
                vec![Some(Row { label: String::new(), outcome, took: Duration::ZERO })]
            }
        };
        shared.entries.push_back(Entry { file, scenario, rows });
    }
    shared.total = shared.waiting.len();
    // Where a case takes long, it is seen from the beginning how many there are.
    (shared.tell)(News::Cases(0, shared.total));
    let shared = Mutex::new(shared);
    let work = || {
        loop {
            let Some((scenario, number, case)) = ({
                let mut shared = locked(&shared);
                shared.report();
                shared.waiting.pop_front()
            }) else {
                return;
            };
            let began = Instant::now();
            let outcome = outcome(case, &start);
            let row = Row { label: case.label.clone(), outcome, took: began.elapsed() };
            let mut shared = locked(&shared);
            let told = shared.reports.len();
            let entry = scenario.checked_sub(told).and_then(|index| shared.entries.get_mut(index));
            if let Some(place) = entry.and_then(|entry| entry.rows.get_mut(number)) {
                *place = Some(row);
            }
            shared.done += 1;
            let news = News::Cases(shared.done, shared.total);
            (shared.tell)(news);
            shared.report();
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    shared.into_inner().unwrap_or_else(PoisonError::into_inner).reports
}

/// A thread that has panicked while it had the lock leaves nothing half done.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn outcome<R: Rig>(case: &Case, start: &impl Fn(&Case) -> Start<R>) -> Outcome {
    let first = case.steps.first().map_or(1, |(source, _)| source.number);
    let failed = |why: String| Outcome::Failed(Mistake::new(first, format!("the module does not start: {why}")));
    match catch_unwind(AssertUnwindSafe(|| start(case))) {
        Ok(Start::Ready(rig)) => run_case(case, rig).map_or_else(Outcome::Failed, |()| Outcome::Passed),
        Ok(Start::LeftOut(reason)) => Outcome::LeftOut(reason),
        Ok(Start::Failed(why)) => failed(why),
        Err(panic) => failed(format!("panicked: {}", said(&*panic))),
    }
}
