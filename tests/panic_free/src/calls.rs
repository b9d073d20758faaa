//! Calls of everything public, each with values the compiler cannot know: what comes out of [`any`] may be anything
//! that its type allows.

use core::fmt::{self, Write};
use core::hint::black_box as any;
use core::marker::PhantomData;

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};
use tmcm::can::outbox::Outbox;
use tmcm::can::{CanFrame, Frame, Id, StandardId};
use tmcm::canopen::{self, BusState, Emergency, Entry, Node, Object, Overflow, ROWS};
use tmcm::chip::at25::At25;
use tmcm::chip::encoder::Counter;
use tmcm::chip::tmc262::{Configuration, Tmc262};
use tmcm::chip::tmc429::{RampGenerator, Register, Tmc429, signed};
use tmcm::device::{Board, Controller, Device, Inputs, Inversion, Parts};
use tmcm::module::ports::Signal;
use tmcm::module::{
    Hooks, LinkEnds, LinkMode, LinkSettings, Message, Module, Origin, Platform, Port, Product, Request, Slots, Source,
    TMCM_1140, TMCM_1140_AXES, TMCM_6110_AXES, Tmcm1140, Tmcm6110, deliver, factory_reset, serve,
};
use tmcm::motion::tmc429::{Tmc429Tmc262, ramp};
use tmcm::motion::{Axis, Hardware, Known, Leg, Mark, Pace, Plan, Sensors, Sought, Until};
use tmcm::param::tmcm1140::{AXIS, GLOBAL};
use tmcm::param::{AxisParameter, GlobalParameter, Interrupt, Parameter, Row, USER_VARIABLES, derived};
use tmcm::store::{Keeper, Need, Store};
use tmcm::tmcl::ascii::{self, Echo, Editor, Line};
use tmcm::tmcl::binary::{self, Addressed, Framer, Telegram};
use tmcm::tmcl::{AxisSet, Command, Instruction, Opcode, Reply, Status, can, text};
use tmcm::units::{CurrentScale, Micros};
use tmcm::vm::{self, Awaited, Condition, ErrorFlag, Errors, Interrupts, Machine, Registers, Signals};

/// A chip that answers anything, or fails.
struct Chip;

impl spi::ErrorType for Chip {
    type Error = spi::ErrorKind;
}

impl SpiDevice for Chip {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::ErrorKind> {
        any(operations);
        any(Ok(()))
    }
}

/// A pin that may fail.
struct Pin;

impl digital::ErrorType for Pin {
    type Error = digital::ErrorKind;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), digital::ErrorKind> {
        any(Ok(()))
    }

    fn set_high(&mut self) -> Result<(), digital::ErrorKind> {
        any(Ok(()))
    }
}

/// All of it.
struct Bare<P, const N: usize>(PhantomData<P>);

impl<P: Product + 'static, const N: usize> Board for Bare<P, N> {
    type Product = P;
    type Hardware = Tmc429Tmc262<Chip, Chip>;
    type Controllers = [Controller<Self::Hardware>; N];
    type Enable = Pin;
    type Store = &'static mut Store<P>;
}

/// The board of a CANopen node.
struct BareNode;

impl Board for BareNode {
    type Product = canopen::Tmcm1140;
    type Hardware = Tmc429Tmc262<Chip, Chip>;
    type Controllers = [Controller<Self::Hardware>; 1];
    type Enable = Pin;
    type Store = &'static mut Store<canopen::Tmcm1140>;
}

impl<P: Product + 'static, const N: usize> Platform for Bare<P, N> {
    type Hooks = Added;
}

/// User functions of which nothing is known.
struct Added;

impl Hooks for Added {
    fn call(&mut self, number: u8, command: Command) -> Result<i32, Status> {
        any((number, command));
        any(Ok(0))
    }
}

fn command() -> Command {
    any(Command::default())
}

fn now() -> Micros {
    any(Micros(0))
}

fn text() -> &'static [u8] {
    any(&[])
}

/// Everything. None of these is made part of another, so that what can panic has a name.
#[inline(never)]
pub(crate) fn all() {
    units();
    language();
    parameters();
    chips();
    motion();
    store();
    machine();
    port();
    module::<Tmcm1140, TMCM_1140_AXES, 1>();
    module::<Tmcm6110, TMCM_6110_AXES, 2>();
    device::<Tmcm1140, TMCM_1140_AXES, 1>();
    device::<Tmcm6110, TMCM_6110_AXES, 2>();
    node();
    #[cfg(feature = "deliberate")]
    any(text()[any(0)]);
}

#[inline(never)]
fn units() {
    any(Micros::from_millis(any(0)).after(now()).since(now()).millis());
    any(CurrentScale::from_parameter(any(0)).bits());
}

#[inline(never)]
fn language() {
    any(command().to_bytes());
    any(Command::from_bytes(any([0; _])));
    any(Status::from_number(any(0)).map(Status::meaning));
    any(Reply::echo(any(Status::Ok), command()).is_event());
    any(Instruction::numbered(any(0)).map(|instruction| instruction.opcode));
    any(AxisSet::of(any(0), any(0)).map(|set| (set.contains(any(0)), set.first())));
    let instruction = Opcode::from_number(any(0)).map(Opcode::instruction);
    any(instruction.map(|instruction| (instruction.required(), instruction.operands().len())));
    if let Ok(line) = core::str::from_utf8(text()) {
        any(Instruction::by_mnemonic(line));
        if let Err(error) = text::parse(line) {
            let _ = any(write!(Paper, "{error}"));
        }
    }

    let _ = any(write!(Paper, "{}", command()));

    any(Line::parse(text()));
    let reply = any(Reply::WRONG_CHECKSUM);
    any(ascii::letter(any(0)));
    any(ascii::encode_reply(any(0), any(0), &reply));
    let mut editor = Editor::new();
    any(&mut editor);
    let echo = any(Echo::from_parameter(any(0))).among_others(any([0; 2]), any(0));
    any(editor.push(any(0), any([0; 2]), echo));

    let telegram: Telegram = any([0; _]);
    any(binary::checksum(&telegram));
    any(binary::encode_command(any(0), command()));
    any(binary::decode_command(&telegram));
    any(binary::decode(&telegram));
    any(binary::encode_plain(any(0), any(0), any(Status::Ok), any(0), any(0)));
    any(binary::encode_reply(any(0), any(0), &reply));
    any(binary::decode_reply(&telegram).and_then(|reply| reply.status()));
    let mut framer = Framer::new();
    any(&mut framer);
    any(framer.push(any(0), now()));
    any(framer.opcode());
    any(framer.decode());
    framer.drop_first();
    framer.reset();
    any(&framer);

    any(can::decode_command(text()));
    let Some(frame) = any(Frame::standard(any(0), text())) else { return };
    any(Frame::received(any(Id::Standard(StandardId::ZERO)), any(false), any(0), any([0; _])));
    any(Frame::new_remote(any(Id::Standard(StandardId::ZERO)), any(0)));
    any((frame.is_extended(), frame.is_remote_frame(), frame.id(), frame.dlc(), frame.data().len(), frame.bytes()));
    any(can::decode(&any(frame)).map(|request| Request::Frame(request).origin(any(Source::Can))));
    any(can::encode_command(command()));
    any(can::reply_frame(any(StandardId::ZERO), any(StandardId::ZERO), any(0), &reply));
    any(can::encode_reply(any(StandardId::ZERO), any(0), &reply));
}

#[inline(never)]
fn parameters() {
    let row = |row: &Row| _ = any((row.stored(), row.unit.symbol()));
    AXIS.rows.iter().for_each(|parameter| row(&parameter.row));
    let found = |row: Option<&Row>| any(row.map(|row| (row.accepts(any(0)), row.writable(), row.slot())));
    any((found(AXIS.find(any(0)).map(|p| &p.row)), found(AXIS.row(any(AxisParameter::MaximumSpeed)))));
    any((found(GLOBAL.find(any(0)).map(|p| &p.row)), found(GLOBAL.row(any(GlobalParameter::CanId)))));
    any((any(AxisParameter::MaximumSpeed).index(), any(GlobalParameter::CanId).index()));
    any((AXIS.defaults(), GLOBAL.defaults()));
    // Rows are derived by the compiler, where a panic is an error.
    const ROWS: [Parameter<AxisParameter>; AXIS.rows.len()] = derived(AXIS.rows, &[], &[]);
    any(ROWS.len());
    if let Some((numbered, index)) = Interrupt::find(any(0), any(0), any(0)) {
        any((numbered.number(index), numbered.per.count(any(0), any(0)), any(Interrupt::Input).first()));
        let _ = numbered.parameter_name(index).map(|name| any(write!(Paper, "{name}")));
    }
}

#[inline(never)]
fn chips() {
    let mut controller = Tmc429::new(Chip);
    any(&mut controller);
    let (generator, register) = (any(RampGenerator::First), any(Register::XTarget));
    let _ = any(controller.halt());
    let _ = any(controller.initialise());
    let _ = any(controller.write_interface(any(true), any(true)));
    let _ = any(controller.write(generator, register, any(0)));
    any(controller.holds(generator, register, any(0)));
    let _ = any(controller.read(generator, register));
    let _ = any(controller.reference_switches());
    controller.forget_switches();
    let _ = any(controller.switches_once());
    let _ = any(controller.confirm());
    any(controller.left_switch(generator));
    any(signed(any(0), any(0)));

    let mut driver = Tmc262::new(Chip);
    any(&mut driver);
    let _ = any(driver.refresh());
    driver.forget();
    let _ = any(driver.apply(&any(CONFIGURATION)));
    any((driver.load(), driver.current(), driver.flags()));

    let mut memory = At25::new(Chip);
    any(&mut memory);
    let _ = any(memory.settle());
    let _ = any(memory.busy());
    let _ = any(memory.read(any(0), any(&mut [])));
    let _ = any(memory.start_write(any(0), any(&[])));

    let mut counter = Counter::<1024>::new();
    any(&mut counter);
    any(counter.update(any(0), any(0), any(true)));
    counter.zero_at(any(0), any(0), any(true));
    counter.set(any(0));
    any(counter.position());
}

const CONFIGURATION: Configuration = Configuration {
    microsteps: 0,
    interpolation: false,
    double_edge: false,
    blank_time: 0,
    constant_toff: false,
    no_fast_decay_comparator: false,
    hysteresis_decrement: 0,
    hysteresis_end: 0,
    hysteresis_start: 0,
    off_time: 0,
    random_off_time: false,
    current_minimum: 0,
    down_step: 0,
    hysteresis: 0,
    up_step: 0,
    cool_step: 0,
    filter: false,
    threshold: 0,
    current: CurrentScale::from_parameter(0),
    slope_high: 0,
    slope_low: 0,
    no_short_protection: false,
    short_timer: 0,
    vsense: false,
};

#[inline(never)]
fn motion() {
    type Chips = Tmc429Tmc262<Chip, Chip>;
    let known = any(Known::default());
    any((known.ahead(), known.mode.positions()));
    any(ramp::braking(any(0), any(0), any(0), any(0)));
    let mut chip = Tmc429::new(Chip);
    any(&mut chip);
    let _ = any(Chips::start(&mut chip));
    let _ = any(Chips::halt(&mut chip));
    any(Chips::answers(&mut chip));
    let _ = any(Chips::invert(&mut chip, any(true), any(true)));
    let [hardware] = Chips::axes([Chip]);
    let mut axis = Axis::new(hardware, &AXIS);
    any((&mut axis, &mut chip));
    let parameter = AXIS.find(any(0));
    if let Some(parameter) = parameter {
        axis.preset(parameter, any(0));
        axis.preset_setting(parameter.function, any(0));
    }
    axis.set_reverse(any(true));
    axis.watch_right_switch(any(None));
    axis.set_turn(any(0));
    any((
        axis.search_status(),
        axis.searches(),
        axis.takes_speed(),
        axis.at_target(),
        axis.last_position(),
        axis.last_speed(),
        axis.target_position(),
    ));
    any((axis.home_switch(), axis.travelling(), axis.rests(), axis.stop_switches(&chip)));
    let mut axis = axis.on(&mut chip);
    let _ = any(axis.start(now()));
    let _ = any(axis.rotate(now(), any(0)));
    let _ = any(axis.move_to(now(), any(0)));
    let _ = any(axis.rotate_at(now(), any(0), any(None)));
    let _ = any(axis.move_at(now(), any(0), any(Pace::default())));
    let _ = any(axis.hard_stop());
    let _ = any(axis.restart_driver());
    any(axis.last_flags());
    let _ = any(axis.start_search(now()));
    const LEGS: &[Leg] = &[Leg::FIND, Leg::to(Until::Index, Mark::First)];
    let plan = Plan { sought: Sought::Stop, positive: true, stops: [true; 2], legs: LEGS, turned: Some(LEGS) };
    let _ = any(axis.search_by(now(), any(plan), any(0), any(0), any(Pace::default())));
    let _ = any(axis.stop_search(now()));
    if let Some(parameter) = parameter {
        let _ = any(axis.write(now(), parameter, any(0)));
        let _ = any(axis.set(now(), parameter.function, any(0)));
        let _ = any(axis.read(parameter.function));
    }
    let _ = any(axis.set_divisors(any(0), any(0)));
    let _ = any(axis.actual_position());
    let _ = any(axis.set_positions(now(), any(0)));
    any(axis.poll(now(), any(Sensors::default()), any(None)));
    axis.refresh();
    any((axis.limited(), axis.pace(), axis.left(), axis.positioning_speed(), axis.correction(any(0))));
    any(axis.slopes(&axis.shape(), any(0)));
    any(parameter.map(|parameter| axis.setting(parameter.function)));
    let _ = any(axis.may_search());
    let _ = any(axis.ready(now(), any(0), any(Pace::default())));
    let _ = any(axis.approach(any(Pace::default())));
    let _ = any(axis.repace(any(Pace::default())));
    let _ = any(axis.break_off(now()));
}

#[inline(never)]
fn store() {
    let mut store = Store::<Tmcm1140>::new();
    any(&mut store);
    store.forget();
    any(&mut store);
    let mut keeper = Keeper::new(At25::new(Chip));
    any(keeper.load(&mut store));
    any(&mut keeper);
    any(&mut store);
    any(keeper.poll(now(), || store.next_job()));
    any(any(Signal::Enable).place());
    let slots: &Slots = any(&TMCM_1140.slots);
    for slot in [slots.variable(any(0)), slots.axis(any(0), any(0)), slots.coordinate(any(0), any(0)), any(Some(0))] {
        any(slot.map(|slot| store.set(slot, any(0))));
        any(slot.map(|slot| store.get(slot)));
    }
    factory_reset(&mut store);
    any(&mut store);
    any((store.integrity(), store.program(), store.downloading(), store.takes_download()));
    store.begin_download(any(0));
    any(&mut store);
    any(store.download(text()));
    store.end_download();
    any(&mut store);
    any(store.erase(any(0)));
    any(&mut store);
    any((store.settled(any(Need::Settings)), store.is_unreachable()));
    any(store.finish(any(true)));
    store.reset(any(true));
    any(&mut store);
    any(store.unreachable());
}

#[inline(never)]
fn machine() {
    let mut registers = any(Registers::default());
    let _ = any(registers.calc(any(0), any(0)));
    let _ = any(registers.calcx(any(0)));
    registers.compare(any(0));
    let mut errors = any(Errors::default());
    errors.raise(any(ErrorFlag::Timeout));
    any(errors.raised(any(ErrorFlag::Timeout)));
    any(errors.clear(any(0)));
    any(Condition::from_number(any(0)).map(|condition| registers.meets(condition, errors)));

    let mut signals = any(Signals::default());
    signals.reached(any(0));
    signals.stall(any(0));
    signals.deviation(any(0));
    signals.stop_switches(any(0), any(true), any(true));
    signals.inputs(any(0));
    let mut interrupts = Interrupts::default();
    any(&mut interrupts);
    interrupts.enable(any(0), any(true));
    interrupts.set_vector(any(0), any(0));
    interrupts.set(any(0), any(0));
    any(interrupts.setting(any(0)));
    interrupts.look(now(), signals, any(true));
    any(interrupts.take());
    interrupts.reset();

    let mut machine = Machine::new(any(0));
    any(&mut machine);
    if let Some(address) = vm::address(any(0), any(0)) {
        machine.run_from(address);
    }
    any(&mut machine);
    any((
        machine.state(),
        machine.counter(),
        machine.wait(),
        machine.waits(),
        machine.runs(),
        machine.busy(),
        machine.handles(),
    ));
    if let Some(opcode) = Opcode::from_number(any(0)) {
        any(machine.execute(now(), opcode, command()));
    }
    let (program, mut variables) = (any([[0; Command::SIZE]; 8]), any([0; USER_VARIABLES]));
    any(machine.burst(&program, &mut variables, any(0), |address, command, refused, registers| {
        any((address, command, refused, registers));
    }));
    any((&variables, vm::is_brief(any(0))));
    any(&mut machine);
    machine.enter_handler(now());
    machine.waited(any(Awaited::Ticks), any(true));
    machine.wait_for_store();
    any(&mut machine);
    any(machine.stores());
    machine.stored();
    machine.step();
    machine.run();
    any(&mut machine);
    machine.stop();
    machine.end();
    machine.rewind();
    machine.next();
    machine.reset();
    any(&mut machine);
}

#[inline(never)]
fn port() {
    let mut port = Port::new(any(Source::Usb), any(LinkMode::Binary));
    any(&mut port);
    let settings = any(LinkSettings::default());
    any(port.push(any(0), now(), || settings));
    any(&mut port);
    any(port.is_ready());
    any(port.is_binary());
    any(port.take());
    any(&mut port);
    any(port.is_waiting());
    let mut message = Message::new();
    any(&mut message);
    let _ = any(port.answer(any(None), any(None), any(settings.reply_addresses()), &mut message));
    any(&mut port);
    port.give_up();
    port.silence();
    any(&mut port);
}

#[inline(never)]
fn device<P: Product + 'static, const AXES: usize, const N: usize>() {
    let store: Option<&'static mut Store<P>> = any(None);
    let Some(store) = store else { return };
    let controllers = [(); N].map(|()| Controller::new(Tmc429::new(Chip)));
    let parts = Parts { controllers, axes: Tmc429Tmc262::axes([const { Chip }; AXES]), enable: Pin, store };
    let mut device: Device<Bare<P, N>, AXES> = Device::new(parts, &AXIS);
    any(&mut device);
    device.halt();
    if let Some(parameter) = AXIS.find(any(0)) {
        device.preset(any(0), parameter, any(0));
    }
    let inversion = any(Inversion::default());
    device.start(now(), inversion);
    device.enable_drivers(any(true));
    any(&mut device);
    let _ = any(device.invert(inversion));
    any(device.begin(now(), &any(Inputs::default())));
    any(&mut device);
    any((device.next_piece(), device.deadline(), device.turn(), device.next_axis(now())));
    device.next_reading();
    any(&mut device);
    any((device.is_locked(), device.lacks_supply(), device.is_given_up(), device.stop_switches(any(0))));
    any(device.end_moves(|axis| axis.hard_stop()));
    any(device.axis(any(0)).is_some());
    device.outputs_mut().restart = any(true);
    any((*device.outputs(), device.inputs().digital, device.axes().len()));
    device.restart_at(now());
    any(device.restart());
    let _ = any(device.start_together(now(), &any([None; AXES])));
    let _ = any(device.start_line(now(), &any([None; AXES])));
    let _ = any(device.leave_line(any(0)));
    let _ = any(device.repace(any(0)));
    any(device.store().get(any(0)));
    any(device.store_mut().next_job());
}

#[inline(never)]
fn module<P: Product + 'static, const AXES: usize, const N: usize>() {
    let spec = any(P::SPEC);
    any((spec.version_string(), spec.version_number()));
    let store: Option<&'static mut Store<P>> = any(None);
    let Some(store) = store else { return };
    let controllers = [(); N].map(|()| Controller::new(Tmc429::new(Chip)));
    let parts = Parts { controllers, axes: Tmc429Tmc262::axes([const { Chip }; AXES]), enable: Pin, store };
    let mut module: Module<Bare<P, N>, AXES> = Module::new(parts, Added, any(0));
    any(&mut module);
    module.start(now(), |store| {
        any(store);
    });
    any(&mut module);
    let _ = any(module.execute(now(), any(Source::Usb), command()));
    any(&mut module);
    any(module.poll(now(), &any(Inputs::default())));
    any(&mut module);
    any(serve(&mut module, &mut Nobody, now));
    deliver(&mut module, &mut Nobody);
    any(&mut module);
    let _ = any(module.request(now(), any(Source::Usb), &any(Request::Telegram(Addressed::default()))));
    any(&mut module);
    let due = any(module.next_reply());
    any(due.and_then(|due| Some(module.link_settings().frame(due.to, &due.reply?))));
    any(&mut module);
    module.stored(any(true));
    any(&mut module);
    any((module.deadline(), module.takes_inputs(now()), module.subscriber(), module.awaits(any(Source::Usb))));
    any((module.spec().number, *module.link_settings(), module.machine().state(), module.axes().len()));
    any((module.baud_rate(), module.can_bit_rate()));
    any(module.store().next_job());
    any(module.hooks());
    module.forget(any(Source::Usb));
    module.hold_program();
}

#[inline(never)]
fn node() {
    let store: Option<&'static mut Store<canopen::Tmcm1140>> = any(None);
    let Some(store) = store else { return };
    let controllers = [Controller::new(Tmc429::new(Chip))];
    let parts = Parts { controllers, axes: Tmc429Tmc262::axes([Chip]), enable: Pin, store };
    let mut node: Node<BareNode> = Node::new(parts);
    any(&mut node);
    node.start(now(), |store| {
        any(store);
    });
    any(&mut node);
    if let Some(frame) = any(Frame::standard(any(0), text())) {
        node.receive(now(), &any(frame));
    }
    any(&mut node);
    any(node.next_frame());
    any(&mut node);
    any(node.poll(now(), &any(Inputs::default())));
    any(&mut node);
    node.bus(now(), any(BusState::Off));
    node.lost(now(), any(Overflow::Receive));
    any(&mut node);
    any(node.filters());
    node.stored(any(true));
    any(&mut node);
    any((node.deadline(), node.takes_inputs(now()), node.node_id(), node.bit_rate(), node.state(), node.axes().len()));
    any((node.is_settled(), node.store().next_job()));
    if let Ok(entry) = any(Entry::find(any(0), any(0))) {
        let row = entry.row();
        any((
            row.accepts(any(0)),
            row.default_number(any(0), any(0)),
            row.count(),
            row.slot(any(0)),
            row.follows_node(),
        ));
        any((row.data.number(), row.data.size(), row.data.range(), row.data.extend(any(0)), row.data.value(any(0))));
    }
    any((Entry::of(any(Object::DeviceType)).row().sub, ROWS.len()));
    let mut outbox = any(Outbox::default());
    any((outbox.has_room(), outbox.is_empty(), outbox.waits(), outbox.step()));
    if let Some(frame) = any(Frame::standard(any(0), text())) {
        any((outbox.post(&any(frame)), outbox.push(&any(frame))));
    }
    outbox.ended(any(0), any(false));
    outbox.clear().for_each(|mailbox| _ = any(mailbox));
    any(&mut outbox);
    any(canopen::usb::reply(&any(Addressed::default())));
    any((any(Emergency::Reset).data(), any(Emergency::Reset).reaction(), any(canopen::Abort::Toggle).code()));
}

/// Links that bring anything.
struct Nobody;

impl LinkEnds for Nobody {
    fn request(&mut self, source: Source, settings: &LinkSettings) -> Option<Request> {
        any((source, settings));
        any(Some(Request::Telegram(Addressed::default())))
    }

    fn answer(&mut self, to: Origin, reply: Option<&Reply>, mode: Option<LinkMode>, settings: &LinkSettings) {
        any((to, reply, mode, settings));
    }
}

/// Takes any text, or fails.
struct Paper;

impl Write for Paper {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        any(text);
        any(Ok(()))
    }
}
