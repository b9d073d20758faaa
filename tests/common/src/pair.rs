//! Two modules that are told the same, one of which leaves polls out.

use crate::random::Random;
use hal_sim::board::Datagram;
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::control::{Control, Line, State};
use hal_sim::world::config::WorldConfig;
use tmcm::module::Source;
use tmcm::tmcl::{Command, binary};
use tmcm_sim::client::Sent;
use tmcm_sim::native::Model;
use tmcm_sim::{NativeModule, VirtualModule};

/// The modules; the first one leaves polls out.
pub struct Pair {
    modules: [NativeModule; 2],
    /// Actions so far, for a message if the two modules differ.
    done: Vec<String>,
}

impl Pair {
    /// In the world that the text describes, with a fresh EEPROM.
    pub fn new(model: impl Into<Model>, world: &str, seed: u32) -> Self {
        let model = model.into();
        let config = WorldConfig::parse_for(model.product().kind(), world).unwrap();
        let mut pair = Self::in_world(model, &config, seed);
        pair.done.push(format!("{model:?} in '{world}' with seed {seed}"));
        pair
    }

    fn in_world(model: Model, config: &WorldConfig, seed: u32) -> Self {
        let modules = [true, false].map(|skips| {
            let mut module = NativeModule::of(model, config, None, seed);
            module.skip(skips);
            module
        });
        Pair { modules, done: Vec::new() }
    }

    /// The present, at which both modules are.
    pub fn now(&self) -> Nanos {
        self.modules[0].now()
    }

    /// Sends a command over USB and waits for the reply, for so long at most.
    pub fn exchange(&mut self, command: Command, patience: Nanos) -> Option<Sent> {
        let telegram = binary::encode_command(1, command);
        let replies = self.modules.each_mut().map(|module| module.exchange(Source::Usb, telegram, patience));
        self.done.push(format!("{} ns: {command}", self.now()));
        self.check("the reply", replies.clone());
        self.compare();
        let [reply, _] = replies;
        reply
    }

    /// Records the commands that programs execute from now on, or no more.
    pub fn trace(&mut self, on: bool) {
        self.both(format!("recorded: {on}"), |module| module.trace(on));
    }

    fn both(&mut self, what: String, mut act: impl FnMut(&mut NativeModule)) {
        self.done.push(format!("{} ns: {what}", self.now()));
        self.modules.iter_mut().for_each(&mut act);
        self.compare();
    }

    /// Sends a command over a link.
    pub fn send(&mut self, source: Source, command: Command) {
        let telegram = binary::encode_command(1, command);
        self.both(format!("{command}"), |module| module.receive(source, telegram));
    }

    /// Carries out a line of the control protocol.
    pub fn control(&mut self, line: &str) {
        self.carry_out(Line::parse(line).unwrap().control);
    }

    /// Carries out a command of the control protocol.
    pub fn carry_out(&mut self, control: Control) {
        self.both(format!("{control:?}"), |module| drop(module.control(control).unwrap()));
    }

    /// Lets time pass.
    pub fn run(&mut self, span: Nanos) {
        self.both(format!("{span} ns pass"), |module| module.run(span));
    }

    /// Records each step of the motors for so long.
    pub fn record(&mut self, span: Nanos) {
        self.both("recorded".into(), |module| {
            let now = module.now();
            let mut board = module.board_mut();
            board.change_world(|world| (0..world.axes().len()).for_each(|n| world.axis_mut(n).start_trace(0, now)));
        });
        self.run(span);
        let traces = self.modules.each_mut().map(|module| {
            let mut board = module.board_mut();
            board.change_world(|world| -> Vec<_> {
                (0..world.axes().len()).map(|n| world.axis_mut(n).take_trace().unwrap().samples().to_vec()).collect()
            })
        });
        self.check("the steps", traces);
    }

    /// Takes the datagrams on the motion bus of a short time.
    pub fn listen(&mut self) {
        let mut heard: [Vec<Datagram>; 2] = Default::default();
        for (module, heard) in self.modules.iter_mut().zip(&mut heard) {
            module.board_mut().take_datagrams();
            module.run(5 * MILLISECOND);
            *heard = module.board_mut().take_datagrams();
        }
        self.check("the datagrams", heard);
    }

    /// Everything that can be seen is the same.
    fn compare(&mut self) {
        let sent = self.modules.each_mut().map(|module| {
            let replies: Vec<_> = std::iter::from_fn(|| module.sent()).collect();
            let frames: Vec<_> = std::iter::from_fn(|| module.frame()).collect();
            (replies, frames)
        });
        self.check("what is sent", sent);
        let seen = self.modules.each_mut().map(seen);
        self.check("what is seen", seen);
    }

    /// From now on both modules poll each millisecond. After a while they are the same to the last bit.
    pub fn end(mut self) {
        self.both("polled".into(), |module| module.skip(false));
        self.run(SECOND);
        let boards = self.modules.each_ref().map(|module| format!("{:?}", module.board().borrow()));
        self.check("the board", boards);
    }

    fn check<T: PartialEq + std::fmt::Debug>(&self, what: &str, [with, without]: [T; 2]) {
        if with != without {
            let last = self.done.len().saturating_sub(40);
            panic!("{what}: {with:?}\ninstead of {without:?}\nafter\n{}", self.done[last..].join("\n"));
        }
    }
}

/// Everything that can be seen of a module but what it sends.
pub fn seen(module: &mut NativeModule) -> impl PartialEq + std::fmt::Debug + use<> {
    let steps = module.take_steps();
    let axes = module.model().product().spec().axes.into();
    let positions: Vec<_> = (0..axes).map(|axis| module.position(axis)).collect();
    let board = module.board_mut();
    let datagrams: Vec<_> = board.datagram_counts().collect();
    (State::of(&board), board.eeprom_bytes(), datagrams, steps, positions)
}

/// A time as those between the requests of a host are, or the lives of machines.
pub fn span(random: &mut Random) -> Nanos {
    let longest = random.pick(&[3, 3, 30, 300, 300, 3_000]) * MILLISECOND;
    1 + random.below(longest)
}
