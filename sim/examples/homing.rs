//! Host software in Rust under test, without a module, a serial port, or waiting. A switch stops the motor, a stall
//! does, and the power goes while a setting is stored. docs/ci.md has the same for a shell.

use tmcm_sim::protocol::Request;
use tmcm_sim::{MILLISECOND, NativeModule, SECOND, Source, VirtualModule, WorldConfig, binary, text};

type Error = Box<dyn std::error::Error>;

/// A command as a telegram to address 1.
fn telegram(command: &str) -> Result<binary::Telegram, Error> {
    let command = text::parse(command).map_err(|error| error.to_string())?;
    Ok(binary::encode_command(1, command))
}

/// Sends a command, and gives the value of the reply. That no reply comes within a second is an error, as it is when
/// the module refuses the command.
fn send(module: &mut NativeModule, command: &str) -> Result<i32, Error> {
    let request = telegram(command)?;
    let reply = module.exchange(Source::Usb, request, SECOND).and_then(|sent| sent.telegram());
    let [_, _, status, _, a, b, c, d, _] = reply.ok_or(format!("{command}: no reply"))?;
    if status != 100 {
        return Err(format!("{command}: status {status}").into());
    }
    Ok(i32::from_be_bytes([a, b, c, d]))
}

/// Changes the world around the module by a command of docs/control.md.
fn world(module: &mut NativeModule, command: &str) -> Result<(), Error> {
    let kind = module.board().borrow().kind();
    let Request::World(line) = Request::parse(command, &[kind])? else { return Err("time passes by run".into()) };
    module.control(line.control)?;
    Ok(())
}

pub(crate) fn main() -> Result<(), Error> {
    // A TMCM-1140 whose motor nothing hinders. Its EEPROM is fresh; seed 1 makes all that is random.
    let mut module = NativeModule::new(&WorldConfig::default(), None, 1);

    // The motor turns to the left, and a hand presses the switch there on the way.
    send(&mut module, "SAP 13, 0, 0")?;
    send(&mut module, "ROL 0, 500")?;
    module.run(100 * MILLISECOND);
    assert_eq!(send(&mut module, "GAP 3, 0")?, -500);
    world(&mut module, "press left")?;
    module.run(5 * MILLISECOND);
    assert_eq!(send(&mut module, "GAP 3, 0")?, 0);
    println!("ok: the switch stops the motor");
    world(&mut module, "release left")?;

    // It turns to the right until something holds it.
    for command in ["SAP 174, 0, 1", "SAP 181, 0, 500", "ROR 0, 1000"] {
        send(&mut module, command)?;
    }
    module.run(SECOND / 2);
    world(&mut module, "load 1")?;
    module.run(SECOND / 2);
    assert_eq!((send(&mut module, "GAP 3, 0")?, send(&mut module, "GAP 207, 0")?), (0, 1));
    println!("ok: a stall stops it");

    // The power goes while a setting is stored.
    for command in ["SAP 4, 0, 1234", "STAP 4, 0", "SAP 4, 0, 500"] {
        send(&mut module, command)?;
    }
    module.receive(Source::Usb, telegram("STAP 4, 0")?);
    module.run(2 * MILLISECOND);
    world(&mut module, "power off")?;
    assert!(module.sent().is_none(), "the module has confirmed what it has not stored");
    println!("ok: the store is not confirmed");
    world(&mut module, "power on")?;
    module.run(100 * MILLISECOND);
    assert_eq!(send(&mut module, "GAP 4, 0")?, 1234);
    println!("ok: the setting is the one before");
    Ok(())
}
