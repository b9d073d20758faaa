//! How far a job has got.

/// How far a job has got. Jobs tell it at their beginning, with nothing done, and whenever there is something new.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress<'a> {
    /// The job that is under way: "loading the program".
    pub what: &'a str,
    /// Number of steps that are done.
    pub done: usize,
    /// Number of steps in all.
    pub total: usize,
}
