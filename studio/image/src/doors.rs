//! The doors for images, beside [those that are always there](mod@tmcl_studio::doors).

use std::cell::RefCell;

use tmcl_studio::doors::{door, door_for_file, put_virtual, time};
use tmcl_tools::failure::Failure;

use crate::image::Image;

thread_local! {
    /// The image that the page has given.
    static IMAGE: RefCell<Option<Image>> = const { RefCell::new(None) };
}

/// Why no module can be started.
const NO_IMAGE: &str = "there is no flash image yet";

tmcl_studio::doors! {
    door_for_file;
    /// Takes an image, an ELF file, and tells what it is for.
    image_take: |elf| {
        let image = Image::read(elf).map_err(Failure::Failed)?;
        let told = image.told();
        IMAGE.set(Some(image));
        Ok(told)
    };
}

tmcl_studio::doors! {
    door;
    /// Starts a virtual module in this instance that runs the image.
    virtual_start_image: |start| {
        let module = IMAGE.with_borrow(|image| match image {
            Some(image) => image.start(&start, time()),
            None => Err(NO_IMAGE.into()),
        });
        module.map(put_virtual).map_err(Failure::Failed)
    };
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};
    use tmcl_studio::doors::{virtual_ask, virtual_control, virtual_look, virtual_turn};

    use super::*;

    type Door = extern "C" fn(usize) -> usize;

    fn ask(door: Door, asked: Value) -> Value {
        serde_json::from_slice(&tmcl_studio::doors::ask(door, asked.to_string().as_bytes())).unwrap()
    }

    fn take(elf: &[u8]) -> Value {
        serde_json::from_slice(&tmcl_studio::doors::ask(image_take, elf)).unwrap()
    }

    fn start(product: &str) -> Value {
        ask(virtual_start_image, json!({ "product": product, "world": null }))
    }

    /// The words of an answer that is an error.
    fn refused(answer: &Value) -> &str {
        answer["error"].as_str().unwrap_or_else(|| panic!("{answer}"))
    }

    /// The words in which a file is no image.
    fn no_image(file: &[u8]) -> String {
        let told = take(file);
        let words = refused(&told);
        assert!(words.starts_with("the image cannot be used: ") && words.contains("`cargo fw`"), "{words}");
        words.into()
    }

    fn image(name: &str) -> Vec<u8> {
        let target = xtask::programs().unwrap().join("..");
        std::fs::read(xtask::image(&target, name).unwrap().path).unwrap()
    }

    /// A program with which a module stops later than a page waits for its start: it counts down, and reads a random
    /// number, of which the emulator knows nothing.
    fn stopping() -> Vec<u8> {
        const COUNT: u32 = 12_000_000;
        const RANDOM: u32 = 0x5006_0808;
        let code: [u16; 6] = [
            0x4802, // ldr r0, =COUNT
            0x3801, // subs r0, #1
            0xD1FD, // bne to that
            0x4902, // ldr r1, =RANDOM
            0x680A, // ldr r2, [r1]
            0xE7FE, // b to that
        ];
        let mut flash = [0x2002_0000_u32, 0x0800_0009].map(u32::to_le_bytes).concat();
        flash.extend(code.iter().flat_map(|half| half.to_le_bytes()));
        flash.extend([COUNT, RANDOM].iter().flat_map(|word| word.to_le_bytes()));
        let length = flash.len() as u32;
        // The head: 32 bits, little-endian, a program for Arm, its one segment behind the head.
        let mut elf = b"\x7fELF\x01\x01\x01".to_vec();
        elf.resize(16, 0);
        elf.extend([2, 40].iter().flat_map(|half: &u16| half.to_le_bytes()));
        elf.extend([1, 0x0800_0009, 52, 0, 0].iter().flat_map(|word: &u32| word.to_le_bytes()));
        elf.extend([52, 32, 1, 40, 0, 0].iter().flat_map(|half: &u16| half.to_le_bytes()));
        let segment = [1, 84, 0x0800_0000, 0x0800_0000, length, length, 5, 4];
        elf.extend(segment.iter().flat_map(|word: &u32| word.to_le_bytes()));
        elf.extend(flash);
        elf
    }

    /// A module in a page, and what it has logged.
    #[derive(Default)]
    struct Desk {
        messages: Vec<String>,
    }

    impl Desk {
        fn turns(&mut self, what: &str, is_over: impl Fn(&Value) -> bool) -> Value {
            for _ in 0..10_000 {
                let turn = ask(virtual_turn, json!({}))["ok"].take();
                let messages = turn["messages"].as_array().unwrap().iter();
                self.messages.extend(messages.map(|message| message.as_str().unwrap().to_owned()));
                if is_over(&turn) {
                    return turn;
                }
            }
            panic!("no end of {what}");
        }

        fn control(&mut self, line: &str) -> Value {
            ask(virtual_control, json!({ "line": line }));
            let turn = self.turns(line, |turn| turn["lines"].as_array().is_some_and(|lines| !lines.is_empty()));
            serde_json::from_str(turn["lines"][0]["line"].as_str().unwrap()).unwrap()
        }

        /// Status and value of the reply to a command, whose value is below 256.
        fn send(&mut self, opcode: u8, kind: u8, value: i32) -> (u64, u64) {
            let request = json!({ "address": 1, "opcode": opcode, "kind": kind, "motor": 0, "value": value });
            ask(virtual_ask, request);
            let turn = self.turns("a request", |turn| turn["replies"].as_array().is_some_and(|all| !all.is_empty()));
            let reply = &turn["replies"][0]["outcome"]["reply"];
            (reply[2].as_u64().unwrap(), reply[7].as_u64().unwrap())
        }
    }

    #[test]
    fn an_image_runs_in_a_page() {
        assert_eq!(refused(&start("1140")), NO_IMAGE);
        assert_eq!(take(&image(xtask::TMCL)), json!({ "ok": { "product": "1140" } }));
        assert_eq!(refused(&start("3212")), "the image is one for the TMCM-1140, and not for the TMCM-3212");
        assert_eq!(start("1140"), json!({ "ok": { "name": "TMCM-1140", "product": "1140" } }));
        let mut desk = Desk::default();
        assert_eq!(desk.control("pause")["ok"], true);
        let before = desk.control("state")["rotor"].as_i64().unwrap();
        assert_eq!(desk.send(1, 0, 500).0, 100);
        desk.control("step 500 ms");
        assert!(desk.control("state")["rotor"].as_i64().unwrap() > before + 500);
        let looked = ask(virtual_look, json!({ "texts": ["GAP 3, 0", "GAP 4, 0"] }));
        assert_eq!(looked["ok"]["values"], json!([500.0, null]), "the memory of an image is not looked at");
        assert!(desk.messages.iter().any(|line| line.ends_with(" info: power on")), "{:?}", desk.messages);
        // What is stored is there after a restart, and the log begins anew.
        assert_eq!((desk.send(5, 4, 77).0, desk.send(7, 4, 0).0), (100, 100));
        desk.messages.clear();
        assert_eq!(desk.control("restart")["ok"], true);
        assert_eq!(desk.send(6, 4, 0), (100, 77));
        assert!(desk.messages.iter().any(|line| line.ends_with(" info: power on")), "{:?}", desk.messages);
    }

    #[test]
    fn what_is_no_image_for_a_page_is_refused_in_words() {
        let file = image(xtask::CANOPEN);
        let told = take(&file);
        assert!(refused(&told).contains("CANopen firmware of the TMCM-1140"), "{told}");
        for length in [0, 3, 52, 100, 10_000] {
            no_image(&file[..length]);
        }
        assert!(no_image(b"[motor]\nfriction = 1\n").contains("not an ELF file"));
        let own = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        assert!(no_image(&own).contains("not an ELF file of 32 bits"));
        assert_eq!(refused(&start("1140")), NO_IMAGE, "what was refused is not kept");
    }

    #[test]
    fn a_module_that_cannot_go_on_is_told() {
        assert_eq!(take(&stopping()), json!({ "ok": { "product": null } }));
        assert!(refused(&start("9999")).contains("'9999' is none of"));
        let world = ask(virtual_start_image, json!({ "product": "1140", "world": "[motor]\nfrictoin = 1" }));
        assert!(refused(&world).contains("frictoin"));
        assert_eq!(start("1140")["ok"]["product"], "1140");
        let mut desk = Desk::default();
        desk.control("pause");
        assert_eq!(desk.turns("a turn", |_| true)["stopped"], Value::Null);
        desk.control("step 2 s");
        let turn = desk.turns("a turn", |_| true);
        assert!(turn["stopped"].as_str().is_some_and(|why| why.contains("read of")), "{turn}");
        assert!(desk.messages.iter().any(|line| line.contains("no serial port on USB")), "{:?}", desk.messages);
    }
}
