//! A host and a virtual module: the host sends a telegram over USB, reads the reply, and looks where the motor is.

use tmcm_sim::{NativeModule, SECOND, Source, WorldConfig, binary, text};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A TMCM-1140 whose motor nothing hinders. Its EEPROM is fresh; seed 1 makes all that is random.
    let mut module = NativeModule::new(&WorldConfig::default(), None, 1);
    let request = binary::encode_command(1, text::parse("MVP ABS, 0, 51200")?);
    let reply = module.exchange(Source::Usb, request, SECOND).and_then(|sent| sent.telegram());
    assert_eq!(reply, Some([2, 1, 100, 4, 0, 0, 200, 0, 51]), "host 2, module 1, status 100, MVP, 51 200");
    // Two seconds of virtual time pass at once.
    module.run(2 * SECOND);
    let position = module.board().borrow().world().axis(0).motor().rotor();
    assert_eq!(position, 51_200, "microsteps");
    println!("the motor has arrived at {position} microsteps");
    Ok(())
}
