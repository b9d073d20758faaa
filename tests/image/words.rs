//! Texts that are there for people alone are in no image: names and notes of parameters, names of objects.

use std::collections::BTreeSet;
use std::path::PathBuf;

use object::{Object, ObjectSegment};
use tmcm::canopen::ROWS;
use tmcm::module::Spec;
use tmcm::param::{INTERRUPTS, Row};
use tmcm::product::{TMCM_1140, TMCM_3212, TMCM_6110};

use common::image;

/// The fewest characters of a text that is looked for: a shorter one may be a part of something else.
const LONG: usize = 12;

/// Reads the bytes that an image has in the microcontroller's memory.
fn loaded(path: PathBuf) -> Vec<u8> {
    let contents = std::fs::read(path).unwrap();
    let file = object::File::parse(&*contents).unwrap();
    file.segments().flat_map(|segment| segment.data().unwrap().to_vec()).collect()
}

fn has(memory: &[u8], text: &str) -> bool {
    memory.windows(text.len()).any(|bytes| bytes == text.as_bytes())
}

/// The names and notes of the parameters of a product, and of interrupts.
fn of_parameters(spec: &Spec) -> impl Iterator<Item = &'static str> {
    let axis = spec.axis.rows.iter().map(|parameter| &parameter.row);
    let global = spec.global.rows.iter().map(|parameter| &parameter.row);
    let interrupts = INTERRUPTS.iter().filter_map(|interrupt| interrupt.row.as_ref());
    let texts = |row: &'static Row| [row.name, row.note];
    axis.chain(global).chain(interrupts).flat_map(texts).chain(INTERRUPTS.iter().map(|interrupt| interrupt.name))
}

#[test]
fn no_names_and_notes_of_parameters_and_objects_are_in_an_image() {
    for (path, spec) in [
        (image::image(), &TMCM_1140),
        (image::canopen(), &TMCM_1140),
        (image::six_axes(), &TMCM_6110),
        (image::three_axes(), &TMCM_3212),
    ] {
        let memory = loaded(path);
        assert!(has(&memory, spec.usb), "the name of the USB device, {}, is to be found", spec.usb);
        let texts = of_parameters(spec).chain(ROWS.iter().map(|row| row.name));
        let texts: BTreeSet<_> = texts.filter(|text| text.len() >= LONG).collect();
        assert!(texts.len() > 150, "{} texts", texts.len());
        let found: Vec<_> = texts.into_iter().filter(|text| has(&memory, text)).collect();
        assert!(found.is_empty(), "{}: {found:?}", spec.usb);
    }
}
