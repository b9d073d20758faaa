//! Functions that the page calls, and functions of the page that are called here. This is the only file with `unsafe`.
//!
//! What is asked goes into a buffer of this instance as JSON, and a door is told how long it is. The door gives the
//! length of the answer, which stands in another buffer. A door that waits for the page is suspended by the browser,
//! and no other job is begun meanwhile: what is read then ([`progress`]) touches nothing of it.
//!
//! A library on top of this one has these doors, too, and makes more of them by the macro [`doors!`](crate::doors!).

use std::cell::{Cell, RefCell};
use std::panic::PanicHookInfo;
use std::time::Duration;

use serde::Serialize;
use serde::de::DeserializeOwned;
use tmcl_tools::failure::Failure;
use tmcl_tools::progress::Progress as Told;

use crate::log::Log;
use crate::page::{Calls, PageStop, PageWire};
use crate::running::Running;
use crate::serial::SerialPort;
use crate::tools::Tools;
use crate::types::{Answer, Module, Nothing, Progress};
use crate::virtual_module::Virtual;
use crate::{language, parameters, scope, session, status, stop, tools, world};

/// The result of a door.
pub type Given<T> = Result<T, Failure>;

thread_local! {
    /// The bytes of what is asked.
    static ASKED: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    /// The bytes of the answer.
    static ANSWERED: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    /// Words and place of the panic that has ended this instance.
    static PANICKED: RefCell<String> = const { RefCell::new(String::new()) };
    /// How far the job has got.
    static PROGRESS: RefCell<Progress> = RefCell::default();
    static VIRTUAL: RefCell<Option<Box<dyn Running>>> = const { RefCell::new(None) };
    static SERIAL: RefCell<SerialPort> = RefCell::default();
    static LOG: RefCell<Log> = RefCell::default();
    static TOOLS: RefCell<Option<Tools>> = const { RefCell::new(None) };
    static IS_READY: Cell<bool> = const { Cell::new(false) };
}

/// The functions of the page that are called here.
const CALLS: Calls = Calls {
    exchange: imports::exchange,
    pause: imports::pause,
    time: imports::time,
    within: imports::within,
    forget: imports::forget,
};
/// Why a door that needs a module gives nothing.
const NO_MODULE: &str = "there is no module yet";

/// Carries a door out at which JSON of so many bytes is asked, and tells the length of the answer.
pub fn door<Q: DeserializeOwned, A: Serialize>(length: usize, carry_out: impl FnOnce(Q) -> Given<A>) -> usize {
    prepare();
    let asked = ASKED.with_borrow(|asked| serde_json::from_slice(asked.get(..length).unwrap_or_default()));
    let asked = asked.map_err(|error| Failure::Failed(format!("what the page asks is not understood: {error}")));
    tell(asked.and_then(carry_out))
}

/// Carries a door out that takes a file of so many bytes, and tells the length of the answer.
pub fn door_for_file<A: Serialize>(length: usize, carry_out: impl FnOnce(Vec<u8>) -> Given<A>) -> usize {
    prepare();
    let mut file = ASKED.take();
    file.truncate(length);
    tell(carry_out(file))
}

/// Sees to it that the words of a panic are kept. Elsewhere the system tells them.
fn prepare() {
    if cfg!(target_arch = "wasm32") && !IS_READY.replace(true) {
        std::panic::set_hook(Box::new(note_panic));
    }
}

fn tell(answer: Given<impl Serialize>) -> usize {
    let answer = match answer {
        Ok(given) => Answer::Ok(given),
        Err(Failure::Failed(words) | Failure::Arguments(words)) => Answer::Error(words),
        Err(Failure::Interrupted { message, .. }) => Answer::Interrupted(message),
    };
    write(&answer)
}

fn write(answer: &impl Serialize) -> usize {
    let bytes =
        serde_json::to_vec(answer).unwrap_or_else(|_| br#"{"error":"the answer cannot be shown as JSON"}"#.into());
    ANSWERED.with_borrow_mut(|answered| {
        *answered = bytes;
        answered.len()
    })
}

fn note_panic(info: &PanicHookInfo<'_>) {
    PANICKED.with_borrow_mut(|words| *words = info.to_string());
}

/// Takes how far a job has got.
fn note(told: Told<'_>) {
    PROGRESS.with_borrow_mut(|progress| {
        *progress = Progress { what: told.what.into(), done: told.done, total: told.total }
    });
}

/// Puts a virtual module into this instance, in the place of the one before.
pub fn put_virtual(module: impl Running + 'static) -> Module {
    let told = module.module();
    VIRTUAL.set(Some(Box::new(module)));
    told
}

/// The clock of the page.
pub fn time() -> Duration {
    imports::time()
}

/// Asks at a door as a page does, for tests on this computer; gives the answer.
pub fn ask(door: extern "C" fn(usize) -> usize, asked: &[u8]) -> Vec<u8> {
    ASKED.set(asked.into());
    let length = door(asked.len());
    ANSWERED.with_borrow(|answered| answered.get(..length).unwrap_or_default().into())
}

fn with_virtual<A>(carry_out: impl FnOnce(&mut dyn Running) -> A) -> Given<A> {
    VIRTUAL.with_borrow_mut(|module| {
        let module = module.as_mut().ok_or(Failure::Failed(NO_MODULE.into()))?;
        Ok(carry_out(module.as_mut()))
    })
}

fn with_tools<A>(carry_out: impl FnOnce(&mut Tools) -> Given<A>) -> Given<A> {
    PROGRESS.with_borrow_mut(|progress| *progress = Progress::default());
    TOOLS.with_borrow_mut(|tools| tools.as_mut().map_or(Err(Failure::Failed(NO_MODULE.into())), carry_out))
}

/// Makes doors of functions from what is asked to what is given. What comes first carries them out:
/// [`door`](crate::doors::door), or [`door_for_file`](crate::doors::door_for_file).
#[macro_export]
macro_rules! doors {
    ($by:path; $($(#[$doc:meta])* $name:ident: $carry_out:expr;)*) => {
        $(
            $(#[$doc])*
            #[unsafe(no_mangle)]
            pub extern "C" fn $name(length: usize) -> usize {
                $by(length, $carry_out)
            }
        )*
    };
}

doors! {
    door;
    /// The products that there are.
    products: |nothing| Ok(tools::products(nothing));
    /// Starts a virtual module in this instance.
    virtual_start: |start| Virtual::start(&start, time()).map(put_virtual).map_err(Failure::Failed);
    /// Starts a virtual module to which is done what was done to another one.
    virtual_play: |play| Virtual::play(&play, time()).map(put_virtual).map_err(Failure::Failed);
    /// The virtual module as it was when it began, and what has been done to it since.
    virtual_done: |Nothing {}| with_virtual(|module| module.done())?.map_err(Failure::Failed);
    /// The contents of the EEPROM of the virtual module.
    virtual_eeprom: |Nothing {}| with_virtual(|module| module.eeprom());
    /// Reads the text of a session, and checks all of it.
    session_read: |text| session::read(&text).map_err(Failure::Failed);
    /// A session as a scenario of `tmcl test`.
    session_scenario: |session| session::write(&session).map_err(Failure::Failed);
    /// Gives a request to the virtual module.
    virtual_ask: |request| with_virtual(|module| module.ask(request));
    /// Gives a line of the control port to the virtual module.
    virtual_control: |line| with_virtual(|module| module.control(&line, time()));
    /// Lets time pass for the virtual module, up to the present.
    virtual_turn: |Nothing {}| with_virtual(|module| module.turn(&time));
    /// Values of the virtual module, which are looked at without letting time pass.
    virtual_look: |watched| with_virtual(|module| module.look(&watched));
    /// The same, and how its time goes.
    virtual_see: |watched| with_virtual(|module| module.see(&watched, time()));
    /// Tells what is wrong with the text of a world, and where.
    world_check: |text| world::check(&text).map_err(Failure::Failed);
    /// Tells what there is to be touched and drawn in a world.
    world_offers: |start| world::offers(&start).map_err(Failure::Failed);
    /// Makes a row of values of the virtual module at each of its milliseconds from now on.
    virtual_watch: |watched| with_virtual(|module| module.watch(&watched));
    /// The bytes of a request on a serial port.
    serial_ask: |request| SERIAL.with_borrow_mut(|port| port.ask(request)).map_err(Failure::Failed);
    /// Takes bytes of a serial port.
    serial_take: |bytes| Ok(SERIAL.with_borrow_mut(|port| port.take(&bytes)));
    /// How a request on a serial port ends whose time is over.
    serial_give_up: |nothing| Ok(SERIAL.with_borrow_mut(|port| port.give_up(nothing)));
    /// The lines of an exchange in the log of a link.
    log_note: |exchanged| Ok(LOG.with_borrow_mut(|log| log.note(&exchanged)));
    /// The requests that stop a module.
    stop_requests: |axes| Ok(stop::requests(&axes));
    /// Tells what a link has to know of a request.
    stop_noted: |moved| Ok(stop::noted(&moved));
    /// Tells what is left to be sent after a request that stops something.
    stop_left: |read| Ok(stop::left(&read));
    /// The curves that a module has.
    scope_offers: |curves| Ok(scope::offers(&curves));
    /// The curves that are wanted.
    scope_curves: |wanted| {
        let curves = scope::curves(&wanted).map_err(Failure::Failed)?;
        Ok(scope::Offers { curves, usual: Vec::new() })
    };
    /// Curves of requests.
    scope_requests: |shown| Ok(scope::of_requests(&shown));
    /// The curves that are always shown of each axis.
    scope_axes: |axes| Ok(scope::axes_of(&axes));
    /// The value of a reply.
    scope_value: |read| Ok(scope::value(&read));
    /// Brings the tools to a module.
    tools_connect: |reach| {
        TOOLS.set(Some(Tools::connect(Box::new(PageWire::new(CALLS)), PageStop(CALLS), &reach)));
        Ok(Nothing {})
    };
    /// Asks the module what it is.
    tools_identify: |nothing| with_tools(|tools| tools.identify(nothing));
    /// Sends a command.
    tools_send: |line| with_tools(|tools| tools.send(&line));
    /// Reads all settings.
    tools_settings: |nothing| with_tools(|tools| tools.settings(nothing, &mut note));
    /// Tells what the module has where a program is to go.
    program_in_the_way: |program| with_tools(|tools| tools.in_the_way(&program, &mut note));
    /// Assembles a program, loads it, and gives it to the debugger.
    program_load: |load| with_tools(|tools| tools.load(&load, &mut note));
    /// Gives a program to the debugger that is in the module already.
    program_attach: |program| with_tools(|tools| tools.attach(&program, &mut note));
    /// Carries a line of the debugger out.
    program_debug: |line| with_tools(|tools| tools.act(&line, &mut note));
    /// Tells what there is to be seen of the program that is debugged.
    program_see: |nothing| with_tools(|tools| tools.see(nothing));
    /// Runs the program in the module, stops it, or brings it back to its beginning.
    program_control: |control| with_tools(|tools| tools.control(control));
    /// The program in the module, as a text.
    program_read: |nothing| with_tools(|tools| tools.read_back(nothing, &mut note));
    /// The requests that read inputs, outputs and axes, and those that switch outputs.
    status_requests: |axes| Ok(status::requests(&axes));
    /// The statements about an axis.
    status_words: |values| Ok(status::words(&values));
    /// Values of inputs and outputs as they are shown.
    status_readings: |read| Ok(status::readings(&read));
    /// Reads what has stopped the motor of an axis, which clears it.
    status_errors: |of| with_tools(|tools| tools.status_errors(&of));
    /// The parts of a text, its mistakes, and what it has.
    text_check: |asked| language::check(asked).map_err(Failure::Failed);
    /// Tells what can be written at a place in a text.
    text_complete: |asked| language::complete(asked).map_err(Failure::Failed);
    /// Tells what stands at a place in a text.
    text_explain: |asked| language::explain(asked).map_err(Failure::Failed);
    /// Tells what can be written at a place in a line of direct mode.
    line_complete: |asked| Ok(language::complete_line(&asked));
    /// The tables of a product's parameters.
    parameters: |of| Ok(parameters::tables(&of));
    /// The contents of a file of parameters.
    parameters_file: |file| parameters::file(&file);
    /// Tells what storing parameters takes.
    parameters_writes: |store| Ok(parameters::words::writes(&store));
    /// Tells what has to be known before parameters are written.
    parameters_automatic: |to| Ok(parameters::words::automatic(&to));
    /// Tells what has to be known before a line of direct mode is sent.
    parameters_typed: |line| Ok(parameters::words::typed(&line));
    /// Values of parameters as they are shown.
    parameters_units: |show| parameters::texts(&show);
    /// The value that was typed for a parameter.
    parameters_number: |typed| parameters::number(&typed);
    /// Reads parameters.
    parameters_read: |meant| with_tools(|tools| tools.read_parameters(&meant, &mut note));
    /// Writes parameters.
    parameters_write: |write| with_tools(|tools| tools.write_parameters(&write, &mut note));
    /// Stores parameters.
    parameters_store: |meant| with_tools(|tools| tools.store_parameters(&meant, &mut note));
    /// Writes lines of a file of parameters.
    parameters_restore: |restore| with_tools(|tools| tools.restore_parameters(&restore, &mut note));
    /// How far the job has got that is under way.
    progress: |Nothing {}| Ok(PROGRESS.with_borrow(Clone::clone));
}

/// Makes room for what is asked, and tells where.
#[unsafe(no_mangle)]
pub extern "C" fn room(length: usize) -> *mut u8 {
    ASKED.with_borrow_mut(|asked| {
        asked.resize(length, 0);
        asked.as_mut_ptr()
    })
}

/// Where the answer stands.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    ANSWERED.with_borrow(|answered| answered.as_ptr())
}

/// The length of the words and the place of the panic that has ended this instance, where [`answer`] tells; 0 if none
/// has.
#[unsafe(no_mangle)]
pub extern "C" fn panicked() -> usize {
    let words = PANICKED.with_borrow(Clone::clone);
    ANSWERED.with_borrow_mut(|answered| {
        *answered = words.into_bytes();
        answered.len()
    })
}

/// The functions of the page that are called here: those of `Wire` and `Stop`, and no other.
#[cfg(target_arch = "wasm32")]
mod imports {
    use std::time::Duration;

    /// Longest answer to a request, in bytes.
    const LONGEST: usize = 4096;

    mod wire {
        #[link(wasm_import_module = "wire")]
        unsafe extern "C" {
            /// Sends a request, and writes what has become of it; gives its length.
            pub(super) fn exchange(asked: *const u8, length: usize, answer: *mut u8, room: usize) -> usize;
            /// Lets so many milliseconds pass. Not 0 if it has been asked to end.
            pub(super) safe fn pause(time: f64) -> u32;
            /// The clock, in milliseconds.
            pub(super) safe fn time() -> f64;
        }
    }

    mod stop {
        #[link(wasm_import_module = "stop")]
        unsafe extern "C" {
            /// Waits for so many milliseconds, or until it has been asked to end; then not 0.
            pub(super) safe fn within(time: f64) -> u32;
            /// Forgets what has been asked so far: it does not count any more.
            pub(super) safe fn forget();
        }
    }

    fn millis(time: Duration) -> f64 {
        time.as_secs_f64() * 1000.0
    }

    pub(super) fn exchange(asked: &[u8]) -> Vec<u8> {
        let mut answer = vec![0; LONGEST];
        // SAFETY: both buffers live until the call returns, and the page writes no more than there is room.
        let length = unsafe { wire::exchange(asked.as_ptr(), asked.len(), answer.as_mut_ptr(), answer.len()) };
        answer.truncate(length);
        answer
    }

    pub(super) fn pause(time: Duration) -> bool {
        wire::pause(millis(time)) != 0
    }

    pub(super) fn time() -> Duration {
        Duration::try_from_secs_f64(wire::time() / 1000.0).unwrap_or_default()
    }

    pub(super) fn within(time: Duration) -> bool {
        stop::within(millis(time)) != 0
    }

    pub(super) fn forget() {
        stop::forget();
    }
}

/// Stand-ins for the page on a computer without one: nobody answers, and time stands still.
#[cfg(not(target_arch = "wasm32"))]
mod imports {
    use std::time::Duration;

    pub(super) fn exchange(_: &[u8]) -> Vec<u8> {
        br#"{"no_reply":0}"#.into()
    }

    pub(super) fn pause(_: Duration) -> bool {
        false
    }

    pub(super) fn time() -> Duration {
        Duration::ZERO
    }

    pub(super) fn within(_: Duration) -> bool {
        false
    }

    pub(super) fn forget() {}
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    fn ask(door: extern "C" fn(usize) -> usize, asked: &str) -> Value {
        serde_json::from_slice(&super::ask(door, asked.as_bytes())).unwrap()
    }

    #[test]
    fn what_is_asked_has_to_be_understood() {
        assert_eq!(ask(products, "{}")["ok"]["products"][0], "1140");
        for wrong in ["", "{", "5", r#"{"more":1}"#, "\u{7f}", "null"] {
            let told = ask(products, wrong);
            assert!(told["error"].as_str().unwrap().starts_with("what the page asks is not understood: "), "{told}");
        }
        assert_eq!(ask(virtual_turn, "{}")["error"], NO_MODULE);
        assert_eq!(ask(tools_send, r#"{"line":"GAP 1, 0"}"#)["error"], NO_MODULE);
    }

    #[test]
    fn a_virtual_module_is_behind_its_doors() {
        assert_eq!(ask(virtual_start, r#"{"product":"3212","world":null}"#)["ok"]["product"], "3212");
        let asked = json!({ "address": 1, "opcode": 6, "kind": 1, "motor": 0, "value": 0 });
        assert_eq!(ask(virtual_ask, &asked.to_string())["ok"]["ticket"], 1);
        ask(virtual_control, r#"{"line":"state"}"#);
        let turn = ask(virtual_turn, "{}");
        assert!(turn["ok"]["lines"][0]["line"].as_str().unwrap().starts_with(r#"{"ok":true"#), "{turn}");
        assert!(ask(virtual_start, r#"{"product":"9","world":null}"#)["error"].is_string());
    }

    #[test]
    fn a_module_that_is_silent_is_told() {
        ask(tools_connect, r#"{"address":1,"timeout":100}"#);
        let told = ask(tools_identify, "{}");
        assert!(told["error"].as_str().is_some_and(|words| words.contains("no reply")), "{told}");
    }

    #[test]
    fn texts_are_looked_at_without_a_module() {
        let texts = json!([{ "name": "a.tmc", "text": "Loop: JA Lop" }]);
        let asked = |more: Value| {
            let mut asked = json!({ "texts": texts, "main": "a.tmc", "product": "1140" });
            asked.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
            asked.to_string()
        };
        let told = ask(text_check, &asked(json!({})));
        assert_eq!(told["ok"]["messages"][0]["advice"], json!({ "instead": "Loop" }));
        let told = ask(text_complete, &asked(json!({ "line": 0, "column": 11 })));
        assert_eq!(told["ok"]["items"], json!([{ "text": "Loop", "note": "label, line 1" }]));
        let told = ask(text_explain, &asked(json!({ "line": 0, "column": 7 })));
        assert_eq!(told["ok"]["found"]["words"], "command 22: JA <value>");
        assert_eq!(ask(text_explain, &asked(json!({ "line": 5, "column": 7 })))["ok"], json!({ "found": null }));
        let told = ask(line_complete, r#"{"line":"GAP APActualP","column":13,"product":"1140"}"#);
        assert_eq!(told["ok"]["items"][0]["text"], "APActualPosition");
        for wrong in [json!({ "more": 1 }), json!({ "main": "b.tmc" })] {
            assert!(ask(text_check, &asked(wrong))["error"].is_string());
        }
    }
}
