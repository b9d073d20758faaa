//! Lines of the user: on a terminal with a prompt, history and completion, elsewhere as they come.

use std::fmt;
use std::io::{BufRead, BufReader, Write};

use rustix::fd::AsFd;
use rustyline::completion::Completer;
use rustyline::error::ReadlineError;
use rustyline::history::MemHistory;
use rustyline::{Config, Context, Helper, Highlighter, Hinter, Validator};
use tmcl_link::EndSignal;
use tmcl_link::poll::{Ready, either};
use tmcl_link::system::{self, Input as StandardInput};
use tmcl_link::wording::words;

use super::is_interactive;
use super::system::Settings;
use crate::failure::{Ended, Failure};

/// The outcome of waiting for a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Input {
    /// A line, without its line end.
    Line(String),
    /// Ctrl-C was pressed.
    Interrupted,
    /// The lines have come to their end: the input has ended, Ctrl-D was pressed, or the terminal is gone.
    End,
}

/// Completion of words that are typed.
pub trait Complete {
    /// The words that may stand at the cursor, which is before the byte `position` of the line, and the byte where they
    /// begin.
    fn complete(&self, line: &str, position: usize) -> (usize, Vec<String>);
}

/// The word before the cursor of a line, which is before the byte `position`: where it begins, what stands before it,
/// and how much of it has been typed.
pub(crate) fn word(line: &str, position: usize) -> (usize, &str, &str) {
    let typed = line.get(..position).unwrap_or(line);
    let inside = |c: &char| c.is_alphanumeric() || *c == '_';
    let length: usize = typed.chars().rev().take_while(inside).map(char::len_utf8).sum();
    let begin = typed.len().saturating_sub(length);
    let (before, word) = typed.split_at_checked(begin).unwrap_or((typed, ""));
    (begin, before, word)
}

/// Whether a word may become a name. Upper and lower case are the same.
pub(crate) fn begins(word: &str, name: &str) -> bool {
    name.get(..word.len()).is_some_and(|beginning| beginning.eq_ignore_ascii_case(word))
}

/// Lines of standard input.
pub struct Editor<C: Complete> {
    from: From<C>,
}

impl<C: Complete> fmt::Debug for Editor<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Editor").finish_non_exhaustive()
    }
}

enum From<C: Complete> {
    Terminal { editor: Box<rustyline::Editor<Assistant<C>, MemHistory>>, settings: Box<Settings> },
    Pipe(BufReader<StandardInput>),
}

impl<C: Complete> Editor<C> {
    /// Lines of the terminal, or of standard input if it or standard output is none.
    ///
    /// # Errors
    /// Standard input cannot be read.
    pub fn open(completion: C) -> Result<Self, Failure> {
        if !is_interactive() {
            let lines = system::standard_input().map_err(unreadable)?;
            return Ok(Editor { from: From::Pipe(BufReader::new(lines)) });
        }
        let settings = Settings::now().map_err(unreadable)?;
        let config = Config::builder().auto_add_history(true).build();
        let history = MemHistory::with_config(&config);
        let mut editor = rustyline::Editor::with_history(config, history).map_err(told)?;
        editor.set_helper(Some(Assistant(completion)));
        Ok(Editor { from: From::Terminal { editor: Box::new(editor), settings: Box::new(settings) } })
    }

    /// True if somebody types the lines.
    pub fn is_terminal(&self) -> bool {
        matches!(self.from, From::Terminal { .. })
    }

    /// Waits for the next line. A signal that comes meanwhile ends the program if there is a terminal, after that has
    /// got its settings back; a pipe is at its end then.
    ///
    /// # Errors
    /// Standard input cannot be read.
    pub fn line(&mut self, prompt: &str, signal: &EndSignal) -> Result<Input, Failure> {
        match &mut self.from {
            From::Terminal { editor, settings } => {
                let read = guarded(signal, settings, || editor.readline(prompt)).map_err(unreadable)?;
                match read {
                    Ok(line) => Ok(Input::Line(line)),
                    Err(ReadlineError::Interrupted) => Ok(Input::Interrupted),
                    Err(ReadlineError::Eof) => {
                        writeln!(std::io::stdout())?;
                        Ok(Input::End)
                    }
                    // A terminal that is gone cannot be read.
                    Err(_) => Ok(Input::End),
                }
            }
            From::Pipe(lines) => {
                if lines.buffer().is_empty() && signalled_first(signal, lines.get_ref()).map_err(unreadable)? {
                    return Ok(Input::End);
                }
                let mut line = String::new();
                match lines.read_line(&mut line).map_err(unreadable)? {
                    0 => Ok(Input::End),
                    _ => Ok(Input::Line(line.trim_end_matches(['\n', '\r']).into())),
                }
            }
        }
    }

    /// The object that completes words; `None` if lines come from a pipe.
    pub fn completion(&mut self) -> Option<&mut C> {
        match &mut self.from {
            From::Terminal { editor, .. } => editor.helper_mut().map(|Assistant(completion)| completion),
            From::Pipe(_) => None,
        }
    }
}

/// Does something that changes the settings of the terminal and waits for the user. If a signal comes meanwhile, the
/// program ends here, after the terminal has got its settings back.
fn guarded<T>(signal: &EndSignal, settings: &Settings, work: impl FnOnce() -> T) -> std::io::Result<T> {
    let (done, waits) = system::pair()?;
    Ok(std::thread::scope(|scope| {
        scope.spawn(move || {
            if signalled_first(signal, &waits).unwrap_or_default() {
                settings.restore();
                std::process::exit(signal.failure("").code().into());
            }
        });
        let result = work();
        drop(done);
        result
    }))
}

/// Waits until there is something to read, or its other end has been closed; true if a signal came first.
fn signalled_first(signal: &EndSignal, input: &impl AsFd) -> std::io::Result<bool> {
    Ok(either(signal, input, None)? == Ready::First)
}

/// The line editor's view of [`Complete`].
#[derive(Helper, Hinter, Highlighter, Validator)]
struct Assistant<C: Complete>(C);

impl<C: Complete> Completer for Assistant<C> {
    type Candidate = String;

    fn complete(&self, line: &str, position: usize, _: &Context<'_>) -> rustyline::Result<(usize, Vec<String>)> {
        Ok(self.0.complete(line, position))
    }
}

fn told(error: ReadlineError) -> Failure {
    let error = match error {
        ReadlineError::Io(error) => words(error),
        error => error.to_string(),
    };
    Failure::Failed(format!("cannot use the terminal: {error}"))
}

fn unreadable(error: std::io::Error) -> Failure {
    Failure::Failed(format!("cannot read standard input: {}", words(error)))
}
