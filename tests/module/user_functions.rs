//! User functions of an image (manual section 3.7.36): what a module does for them, by telegrams.

use std::task::Poll;

use common::{EEPROM_LOCKED, INVALID_COMMAND, INVALID_VALUE, NOT_AVAILABLE, OK, WRONG_TYPE, telegram};
use hal_sim::board::{Board, SharedBoard};
use hal_sim::clock::{MICROSECOND, MILLISECOND};
use hal_sim::control::Line;
use hal_sim::world::config::WorldConfig;
use tmcm::device::Inputs;
use tmcm::module::{Execute, Hooks, Module, Request, Source, ports};
use tmcm::tmcl::{Command, Instruction, Reply, Status, binary, text};
use tmcm::units::Micros;
use tmcm_sim::native::{Simulated, parts};

/// Status of a reply: the command was stored in program memory.
const LOADED: u8 = 101;

/// UF0 remembers a value, UF1 adds, UF2 refuses. UF3 has commands carried out, UF4 calls the method of which its type
/// is the number, and UF5 doubles the accumulator of a program. The others are as they were.
#[derive(Default)]
struct Functions {
    memory: i32,
    /// Commands that UF3 has carried out.
    commands: Vec<Command>,
    /// The result of each of these commands.
    done: Vec<Result<i32, Status>>,
    /// Number of calls of UF5.
    calls: u32,
}

impl Hooks for Functions {
    fn call(&mut self, number: u8, command: Command, module: &mut impl Execute) -> Result<i32, Status> {
        let Command { kind, motor, value, .. } = command;
        match number {
            0 => Ok(std::mem::replace(&mut self.memory, value)),
            1 => Ok(value + i32::from(kind) + i32::from(motor)),
            2 => Err(Status::InvalidValue),
            3 => {
                self.done = self.commands.iter().map(|command| module.execute(*command)).collect();
                self.done.last().copied().unwrap_or(Ok(0))
            }
            4 => named(module, kind, motor, value),
            5 => {
                self.calls += 1;
                let registers = module.registers();
                registers.load(registers.accumulator.wrapping_mul(2));
                Ok(value)
            }
            _ => ().call(number, command, module),
        }
    }
}

/// Calls a method by its place in [`NAMED`].
fn named(module: &mut impl Execute, method: u8, motor: u8, value: i32) -> Result<i32, Status> {
    match method {
        0 => module.axis_parameter(value as u8, motor),
        1 => module.set_axis_parameter(4, motor, value),
        2 => module.global_parameter(value as u8, motor),
        3 => module.set_global_parameter(79, motor, value),
        4 => module.variable(value as u8),
        5 => module.set_variable(3, value),
        6 => module.input(value as u8, motor),
        7 => module.set_output(motor, value != 0),
        8 => module.rotate(motor, value),
        9 => module.stop(motor),
        10 => module.move_to(motor, value),
        _ => module.move_by(motor, value),
    }
}

/// Methods of [`Execute`]: which command each is short for, with # and $ for motor and value, and which of these to
/// try. First comes what is done, then what is refused, as with values out of range and axes, banks and ports that do
/// not exist.
type Method = (&'static str, &'static [(u8, i32)], &'static [(u8, i32)]);
const NAMED: [Method; 12] = [
    ("GAP $, #", &[(0, 4), (0, 1)], &[(1, 4), (0, 255)]),
    ("SAP 4, #, $", &[(0, 1500)], &[(0, 3000), (0, -1), (1, 1500)]),
    ("GGP $, #", &[(0, 66), (2, 255), (3, 0)], &[(1, 66), (0, 1)]),
    ("SGP 79, #, $", &[(0, 1)], &[(0, 8), (1, 1)]),
    ("GGP $, 2", &[(0, 3), (0, 255)], &[]),
    ("SGP 3, 2, $", &[(0, i32::MIN), (0, 17)], &[]),
    ("GIO $, #", &[(0, 0), (1, 0), (1, 8), (2, 1), (0, 255)], &[(0, 9), (3, 0)]),
    ("SIO #, 2, $", &[(0, 1), (1, 1), (0, 0)], &[(2, 1)]),
    ("ROR #, $", &[(0, 700), (0, -2047), (0, 0)], &[(0, 2048), (1, 700)]),
    ("MST #", &[(0, 0)], &[(1, 0)]),
    ("MVP ABS, #, $", &[(0, 5000), (0, -123_456)], &[(1, 5000)]),
    ("MVP REL, #, $", &[(0, 5000), (0, -9)], &[(7, 5000)]),
];

/// A module with these functions on a board of its own, in virtual time.
struct Rig {
    board: SharedBoard,
    module: Module<Simulated<Functions>, 1>,
    /// Whether the EEPROM takes what is written to it, in no time.
    writes: bool,
}

impl Rig {
    fn new() -> Self {
        let board = SharedBoard::new(Board::new(&WorldConfig::default(), 1));
        let mut module = Module::new(parts(&board), Functions::default(), 1);
        module.start(Micros(0), |_| {});
        let mut rig = Rig { board, module, writes: true };
        rig.control("analog 0 1234");
        rig.run(1);
        rig
    }

    fn now(&self) -> Micros {
        Micros(self.board.borrow().now() / MICROSECOND)
    }

    fn control(&mut self, line: &str) {
        Line::parse(line).unwrap().control.apply(&mut self.board.borrow_mut()).unwrap();
    }

    /// Lets milliseconds pass.
    fn run(&mut self, span: u32) {
        for _ in 0..span {
            let next = self.board.borrow().now() + MILLISECOND;
            self.board.borrow_mut().advance_to(next);
            let seen = self.board.borrow().inputs();
            let mut inputs = Inputs { supply: Some(seen.supply), digital: seen.digital as u16, ..Inputs::default() };
            inputs.analog[0] = seen.analog[0];
            while self.module.deadline() <= self.now() {
                self.module.poll(self.now(), &inputs);
                self.store();
            }
        }
    }

    /// Does the jobs of the EEPROM.
    fn store(&mut self) {
        while self.module.store().next_job().is_some() {
            self.module.stored(self.writes);
        }
    }

    /// Sends a telegram over USB; the reply if it comes before anything is stored.
    fn post(&mut self, line: &str) -> Option<(u8, i32)> {
        let request = Request::Telegram(binary::decode(&telegram(line)));
        match self.module.request(self.now(), Source::Usb, &request).0 {
            Poll::Ready(reply) => Some(received(&reply.unwrap())),
            Poll::Pending => None,
        }
    }

    /// Sends a telegram and gives status and value of the reply, which may come once something is stored.
    fn ask(&mut self, line: &str) -> (u8, i32) {
        self.post(line).unwrap_or_else(|| {
            self.store();
            received(&self.module.next_reply().unwrap().reply.unwrap())
        })
    }

    fn ok(&mut self, line: &str) -> i32 {
        let (status, value) = self.ask(line);
        assert_eq!(status, OK, "{line}");
        value
    }

    /// Has UF3 carry commands out; gives what became of each, and the reply.
    fn carry_out(&mut self, lines: &[&str]) -> (Vec<Result<i32, Status>>, (u8, i32)) {
        self.module.hooks().commands = lines.iter().map(|line| text::parse(line).unwrap()).collect();
        let reply = self.ask("UF3");
        (std::mem::take(&mut self.module.hooks().done), reply)
    }

    /// Loads a program to address 0, and starts it.
    fn start(&mut self, lines: &[&str]) {
        self.ok("132, 0, 0, 0");
        for line in lines {
            assert_eq!(self.ask(line).0, LOADED, "{line}");
        }
        self.ok("133");
        self.ok("129, 1, 0, 0");
    }

    fn runs(&self) -> bool {
        self.module.machine().runs()
    }

    /// All that is asked of the module, and its axis, to the last field.
    fn look(&mut self) -> String {
        let read = ["GGP 79, 0", "GGP 3, 2", "GIO 0, 2", "GIO 1, 2", "GAP 4, 0"].map(|line| self.ask(line));
        format!("{read:?} {:?} {:?}", self.module.machine(), self.module.axes())
    }
}

/// Status and value of a reply, as the host sees them.
fn received(reply: &Reply) -> (u8, i32) {
    let received = binary::decode_reply(&binary::encode_reply(2, 1, reply)).unwrap();
    (received.status, received.value)
}

#[test]
fn user_functions_of_an_image() {
    let mut rig = Rig::new();
    for (line, status, value) in [
        ("UF1 200, 100, 1000", OK, 1300),
        ("UF2 0, 0, 5", INVALID_VALUE, 5),
        ("UF0 0, 0, 7", OK, 0),
        ("UF0 0, 0, 8", OK, 7),
        ("UF6 0, 0, 9", NOT_AVAILABLE, 9),
        ("UF7 0, 0, -9", NOT_AVAILABLE, -9),
    ] {
        assert_eq!(rig.ask(line), (status, value), "{line}");
    }
}

/// A function that has one command carried out leads to what a host reaches with this command.
#[test]
fn each_method_does_what_its_command_does() {
    let (mut called, mut told) = (Rig::new(), Rig::new());
    for (method, (line, done, refused)) in NAMED.into_iter().enumerate() {
        let all = done.iter().map(|what| (what, true)).chain(refused.iter().map(|what| (what, false)));
        for ((motor, value), is_done) in all {
            let command = line.replace('#', &motor.to_string()).replace('$', &value.to_string());
            let function = format!("UF4 {method}, {motor}, {value}");
            let (was, is) = (told.ask(&command), called.ask(&function));
            assert_eq!(was.0 == OK, is_done, "{command}");
            // What is refused comes back with the value of the one command or of the other.
            let echo = if is_done { was.1 } else { *value };
            assert_eq!(is, (was.0, echo), "{function} for {command}");
            for rig in [&mut called, &mut told] {
                rig.run(40);
            }
            assert_eq!(called.look(), told.look(), "{function} for {command}");
        }
    }
}

#[test]
fn a_function_sees_its_inputs() {
    let mut rig = Rig::new();
    assert_eq!(rig.ok(&format!("UF4 6, {}, 0", ports::ANALOG)), 1234);
    rig.control("analog 0 4000");
    rig.control("input 1 1");
    rig.run(2);
    assert_eq!(rig.ok(&format!("UF4 6, {}, 0", ports::ANALOG)), 4000);
    assert_eq!(rig.ok(&format!("UF4 6, {}, 1", ports::INPUTS)), 1);
}

/// Control commands, commands that are a program's alone, and other functions, so that none ever calls itself.
#[test]
fn what_a_function_may_not_do_is_refused() {
    let mut rig = Rig::new();
    for number in 0..=u8::MAX {
        let expected = match Instruction::numbered(number) {
            None => INVALID_COMMAND,
            Some(row) if row.direct && (number < 64) => continue,
            Some(_) => NOT_AVAILABLE,
        };
        // With the values with which hosts have them executed.
        for command in [Command::new(number, 0, 0, 0), Command::new(number, 0, 0, 1234)] {
            rig.module.hooks().commands = vec![command];
            assert_eq!(rig.ask("UF3 0, 0, 5"), (expected, 5), "{command:?}");
        }
    }
    assert_eq!((rig.ask("UF0"), rig.module.is_restarting()), ((OK, 0), false));
    let (done, reply) = rig.carry_out(&["UF0 0, 0, 5", "UF3", "GAP 4, 0", "ROR 1, 5", "GGP 66, 0"]);
    let refused = Err(Status::NotAvailable);
    assert_eq!(done, [refused, refused, Ok(1000), Err(Status::InvalidValue), Ok(1)]);
    assert_eq!((reply, rig.ask("UF0")), ((OK, 1), (OK, 0)));
}

/// A function has the accumulator of the program that calls it. It costs as much as a command that talks to a chip.
#[test]
fn a_program_calls_functions() {
    let mut rig = Rig::new();
    rig.module.hooks().commands = vec![text::parse("ROR 0, 700").unwrap()];
    rig.start(&["CALC LOAD, 21", "UF3", "UF2", "UF7", "UF5", "AGP 1, 2", "STOP"]);
    rig.run(10);
    assert_eq!((rig.runs(), rig.ok("GGP 1, 2"), rig.ok("GAP 2, 0")), (false, 42, 700));
    rig.start(&["UF5", "JA 0"]);
    let before = rig.module.hooks().calls;
    rig.run(100);
    assert_eq!(rig.module.hooks().calls - before, 700);
}

#[test]
fn a_host_calls_functions_while_a_program_runs() {
    let mut rig = Rig::new();
    rig.start(&["GGP 0, 2", "CALC ADD, 1", "AGP 0, 2", "WAIT TICKS, 0, 1", "JA 0"]);
    for n in 1..=10 {
        rig.run(10);
        assert_eq!(rig.ok(&format!("UF4 8, 0, {}", 100 * n)), 100 * n);
        assert_eq!((rig.ok("GAP 2, 0"), rig.runs()), (100 * n, true));
        assert!((n..=n + 1).contains(&rig.ok("GGP 0, 2")), "it counts on, each 10 ms");
    }
    // A function may stop the program: it takes the read protection off, and so erases it.
    rig.ok("SGP 81, 0, 3");
    let (done, reply) = rig.carry_out(&["SGP 81, 0, 0"]);
    assert_eq!((done, reply, rig.runs()), (vec![Ok(0)], (OK, 0), false));
}

/// The reply comes when all is stored; a program waits as long.
#[test]
fn what_a_function_stores_survives_its_reply() {
    let mut rig = Rig::new();
    rig.module.hooks().commands = ["STAP 4, 0", "GGP 66, 0"].map(|line| text::parse(line).unwrap()).to_vec();
    assert_eq!(rig.ask("SAP 4, 0, 900"), (OK, 900));
    assert_eq!(rig.post("UF3"), None);
    assert_eq!(rig.post("GAP 4, 0"), Some((OK, 900)));
    rig.store();
    assert_eq!(received(&rig.module.next_reply().unwrap().reply.unwrap()), (OK, 1));
    // What is stored already has its reply at once.
    assert_eq!(rig.post("UF3"), Some((OK, 1)));
    rig.start(&["UF3", "SGP 5, 2, 1", "STOP"]);
    rig.ok("SAP 4, 0, 901");
    rig.run(5);
    assert_eq!((rig.runs(), rig.ok("GGP 5, 2")), (false, 1));
}

/// A function that has the program erased and a setting stored is answered when both are done, in whatever order.
#[test]
fn the_reply_waits_for_all_that_is_stored() {
    for lines in [["SGP 81, 0, 0", "STAP 4, 0"], ["STAP 4, 0", "SGP 81, 0, 0"]] {
        let mut rig = Rig::new();
        rig.start(&["JA 0"]);
        rig.ok("SGP 81, 0, 3");
        rig.ok("SAP 4, 0, 900");
        rig.module.hooks().commands = lines.map(|line| text::parse(line).unwrap()).to_vec();
        assert_eq!(rig.post("UF3"), None);
        let mut reply = None;
        while rig.module.store().next_job().is_some() {
            assert_eq!(reply, None, "something is still to be stored");
            rig.module.stored(true);
            reply = rig.module.next_reply();
        }
        assert_eq!(received(&reply.unwrap().reply.unwrap()).0, OK);
    }
}

#[test]
fn an_eeprom_that_fails_is_told_and_takes_a_coordinate_back() {
    let mut rig = Rig::new();
    rig.ok("SGP 84, 0, 1");
    assert_eq!(rig.carry_out(&["SCO 1, 0, 11", "SGP 7, 2, 1"]), (vec![Ok(11), Ok(1)], (OK, 1)));
    // Only one can be taken back, so there is only one.
    let (done, _) = rig.carry_out(&["SCO 2, 0, 22", "SCO 3, 0, 33", "CCO 3, 0", "ACO 3, 0", "GCO 3, 0"]);
    let refused = Err(Status::NotAvailable);
    assert_eq!(done, [Ok(22), refused, refused, refused, Ok(0)]);
    rig.writes = false;
    let (done, reply) = rig.carry_out(&["SCO 1, 0, 12", "SGP 76, 0, 9"]);
    assert_eq!((done, reply), (vec![Ok(12), Ok(9)], (EEPROM_LOCKED, 0)));
    assert_eq!([rig.ok("GCO 1, 0"), rig.ok("GCO 2, 0"), rig.ok("GGP 76, 0")], [11, 22, 2]);
    rig.writes = true;
    rig.ok("SGP 84, 0, 0");
    assert_eq!(rig.carry_out(&["SCO 1, 0, 5", "SCO 2, 0, 6", "SCO 0, 255, 0"]).1, (OK, 0));
}

/// Links and the host of command 138 are told what a function has done, as if a host had sent its commands.
#[test]
fn links_and_hosts_hear_of_what_a_function_does() {
    let mut rig = Rig::new();
    rig.carry_out(&["SGP 66, 0, 7"]);
    rig.run(1);
    assert_eq!(rig.module.link_settings().address, 7);
    rig.ok("138, 0, 0, 1");
    rig.ok("UF4 10, 0, 3000");
    rig.run(1000);
    let event = rig.module.next_event(|_| true).unwrap().reply.unwrap();
    assert_eq!((received(&event), rig.ok("GAP 1, 0")), ((128, 1), 3000));
    // No motor is started for a host that is not heard any more.
    rig.module.hooks().commands = vec![text::parse("ROR 0, 500").unwrap()];
    rig.start(&["WAIT TICKS, 0, 30", "UF3", "SGP 1, 2, 1", "STOP"]);
    rig.carry_out(&["SGP 68, 0, 100"]);
    rig.module.hooks().commands = vec![text::parse("ROR 0, 500").unwrap()];
    rig.run(500);
    assert_eq!(rig.module.hooks().done, [Err(Status::NotAvailable)]);
    assert_eq!((rig.ok("GGP 1, 2"), rig.ok("GAP 2, 0")), (1, 0));
    assert_eq!(rig.ask("UF4 1, 0, -1"), (INVALID_VALUE, -1));
    assert_eq!(rig.ask("UF4 0, 0, 255"), (WRONG_TYPE, 255));
}
