//! The report in JUnit's form: a suite for each file, a test case for each row. It is valid by the schema of Jenkins'
//! xUnit plugin (junit-10.xsd).

use std::time::Duration;

use quick_junit::{NonSuccessKind, Report as Document, TestCase, TestCaseStatus, TestSuite};
use tmcm_sim::scenario::suite::{Outcome, Report, Row};

use crate::failure::Failure;

/// Characters that a text may hold, but no document of XML; control characters are left out as the document is written.
const NO_CHARACTERS: [char; 2] = ['\u{fffe}', '\u{ffff}'];

/// The report of a run as XML.
pub(super) fn text(reports: &[Report], took: Duration) -> Result<String, Failure> {
    let mut document = Document::new("tmcl test");
    document.set_time(took);
    for file in reports.chunk_by(|one, other| one.file == other.file) {
        let mut suite = TestSuite::new(file.first().map_or("", |report| &report.file));
        let rows = || file.iter().flat_map(|report| report.rows.iter().map(move |row| (report, row)));
        suite.set_time(rows().map(|(_, row)| row.took).sum());
        suite.add_test_cases(rows().map(|(report, row)| test_case(report, row)));
        document.add_test_suite(suite);
    }
    let text = document.to_string().map_err(|error| Failure::Failed(format!("--junit: {error}")))?;
    Ok(without_total_of_skipped(&text).replace(NO_CHARACTERS, "\u{fffd}"))
}

fn test_case(report: &Report, row: &Row) -> TestCase {
    let name = if row.label.is_empty() { report.title.clone() } else { format!("{} ({})", report.title, row.label) };
    let status = match &row.outcome {
        Outcome::Passed => TestCaseStatus::success(),
        Outcome::LeftOut(reason) => {
            let mut status = TestCaseStatus::skipped();
            status.set_message(reason.as_str());
            status
        }
        Outcome::Failed(mistake) => {
            let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
            status.set_type("scenario").set_message(mistake.message.as_str());
            status.set_description(format!("{}:{}: {}", report.file, mistake.line, mistake.message));
            status
        }
    };
    let mut case = TestCase::new(name, status);
    case.set_classname(report.file.as_str()).set_time(row.took);
    case
}

/// The schema has the number of skipped test cases at each suite, but not at all of them together.
fn without_total_of_skipped(text: &str) -> String {
    let Some((before, after)) = text.split_once(" skipped=\"") else { return text.into() };
    let rest = after.split_once('"').map_or("", |(_, rest)| rest);
    format!("{before}{rest}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use tmcm_sim::scenario::Mistake;

    #[test]
    fn each_row_is_a_test_case() {
        let row = |label: &str, outcome| Row { label: label.into(), outcome, took: Duration::from_millis(1500) };
        let failed = Outcome::Failed(Mistake { line: 7, message: "expect rotor < 5: the left side is 9".into() });
        let report = |file: &str, title: &str, rows| Report { file: file.into(), line: 1, title: title.into(), rows };
        let reports = [
            report("a.txt", "One & all", vec![row("x = 1", Outcome::Passed), row("x = 2", failed)]),
            report("a.txt", "Two\u{fffe}", vec![row("", Outcome::LeftOut("too slow".into()))]),
            report("b.txt", "Three", vec![row("", Outcome::Passed)]),
        ];
        let expected = r#"<?xml version="1.0" encoding="UTF-8"?>
<testsuites name="tmcl test" tests="4" failures="1" errors="0" time="6.000">
    <testsuite name="a.txt" tests="3" skipped="1" errors="0" failures="1" time="4.500">
        <testcase name="One &amp; all (x = 1)" classname="a.txt" time="1.500"/>
        <testcase name="One &amp; all (x = 2)" classname="a.txt" time="1.500">
            <failure message="expect rotor &lt; 5: the left side is 9" type="scenario">a.txt:7: expect rotor &lt; 5: the left side is 9</failure>
        </testcase>
        <testcase name="Two�" classname="a.txt" time="1.500">
            <skipped message="too slow"/>
        </testcase>
    </testsuite>
    <testsuite name="b.txt" tests="1" skipped="0" errors="0" failures="0" time="1.500">
        <testcase name="Three" classname="b.txt" time="1.500"/>
    </testsuite>
</testsuites>
"#;
        let text = text(&reports, Duration::from_secs(6)).unwrap();
        // Entities for > and quotes are a matter of taste.
        assert_eq!(text.replace("&gt;", ">").replace("&quot;", "\""), expected);
    }
}
