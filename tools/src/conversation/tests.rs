//! Conversations with virtual modules, and with wires that fail.

use std::cell::RefCell;

use tmcm::tmcl::{Reply, binary};
use tmcm_sim::{NativeModule, VirtualModule};

use super::*;
use crate::stop::Never;
use crate::wire::VirtualWire;

thread_local! {
    static TOLD: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

fn tell(text: &str) {
    TOLD.with_borrow_mut(|told| told.push(text.into()));
}

fn with(product: Product) -> Conversation {
    let module = NativeModule::of(product, &hal_sim::world::config::WorldConfig::default(), None, 1);
    Conversation::new(Box::new(VirtualWire::new(module)), 1, None, tell)
}

#[test]
fn a_module_tells_what_it_is_and_has() {
    for product in Product::ALL {
        let mut module = with(product);
        assert_eq!(module.known_product().unwrap(), product);
        assert_eq!(usize::from(module.axes().unwrap()), usize::from(product.spec().axes));
        assert_eq!(module.version().unwrap(), module.identity().unwrap().to_string());
        assert!(module.no_such_axis(6).unwrap().is_some_and(|told| told.starts_with("axis 6: the module has ax")));
    }
    TOLD.with_borrow(|told| assert_eq!(told, &[""; 0]));
}

/// Time is that of the module: a pause takes as long as it is to take, and the exchanges in between a little.
#[test]
fn time_passes_for_the_module() {
    let mut module = with(Product::Tmcm1140);
    module.request(Command::new(Opcode::Ror as u8, 0, 0, 500)).unwrap();
    let before = module.time();
    assert!(!module.pause(Duration::from_secs(1), &Never));
    assert_eq!(module.time() - before, Duration::from_secs(1));
    assert_eq!(module.speed(0).unwrap(), (500, "500 int".into()));
    assert!(module.simulated().is_some());
}

#[test]
fn refusals_and_silence_are_errors() {
    let mut module = with(Product::Tmcm1140);
    let refused = module.value(Command::new(Opcode::Gap as u8, 255, 0, 0)).unwrap_err();
    assert!(refused.is_refusal() && refused.is(Status::WrongType), "{refused}");
    module.turn_to(256);
    let far = module.value(Command::new(Opcode::Gap as u8, 1, 0, 0)).unwrap_err();
    assert!(matches!(far, Error::Link { error: LinkError::Address, .. }), "{far}");
    // Over USB the module answers whatever the address, but not without power.
    module.turn_to(7);
    assert_eq!(module.value(Command::new(Opcode::Gap as u8, 1, 0, 0)).unwrap(), 0);
    module.simulated().unwrap().set_power(false);
    module.set_timeout(Duration::from_millis(50));
    let before = module.time();
    let silent = module.value(Command::new(Opcode::Gap as u8, 1, 0, 0)).unwrap_err();
    assert!(matches!(silent, Error::Link { error: LinkError::NoReply { bytes: 0 }, .. }), "{silent}");
    assert_eq!(module.time() - before, Duration::from_millis(50));
}

/// A wire that says the same to everything.
struct Parrot(Result<i32, fn() -> LinkError>);

impl Wire for Parrot {
    fn exchange(&mut self, _: u16, command: Command) -> Result<Telegram, LinkError> {
        let value = self.0.map_err(|error| error())?;
        Ok(binary::encode_reply(2, 1, &Reply::Plain { status: Status::Ok, opcode: command.opcode, value }))
    }

    fn set_timeout(&mut self, _: Duration) {}

    fn time(&self) -> Duration {
        Duration::ZERO
    }

    fn pause(&mut self, _: Duration, stop: &dyn Stop) -> bool {
        stop.happened()
    }
}

#[test]
fn strange_modules_and_silent_ones_are_told_of_once() {
    let mut strange = Conversation::new(Box::new(Parrot(Ok(0x270F_0102))), 1, None, tell);
    assert_eq!((strange.product().unwrap(), strange.product().unwrap()), (None, None));
    let told = strange.known_product().unwrap_err().to_string();
    assert!(told.starts_with("a TMCM-9999 is not known here"), "{told}");
    let mut silent = Conversation::new(Box::new(Parrot(Err(|| LinkError::NoReply { bytes: 0 }))), 1, None, tell);
    assert_eq!(silent.product().unwrap(), Some(Product::default()));
    TOLD.with_borrow(|told| {
        let [first, second] = told.as_slice() else { panic!("{told:?}") };
        assert!(first.starts_with("this module is a TMCM-9999, which is not known here"), "{first}");
        assert!(second.starts_with("this module does not tell what it is (command 136)"), "{second}");
    });
    let mut closed = Conversation::new(Box::new(Parrot(Err(|| LinkError::Closed))), 1, None, tell);
    assert!(matches!(closed.product(), Err(Error::Link { error: LinkError::Closed, .. })));
}
