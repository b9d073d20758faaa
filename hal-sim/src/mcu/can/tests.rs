use super::errors::{BOFF, EPVF, EWGF};
use super::fifo::RFOM;
use super::*;

const BIT: Cycles = 168;
const IDLE: u32 = 0x1C00_0000;

/// 1 Mbit/s at 42 MHz: 14 quanta of three clocks of four core cycles.
fn controller() -> Can {
    let mut can = Can::new();
    can.set_divider(4);
    can.set_core_clock(168_000_000);
    can.write(MCR, 1 << INRQ).unwrap();
    assert_eq!(can.read(MSR).unwrap() & 3, 1);
    can.write(BTR, 2 | 10 << 16 | 1 << 20).unwrap();
    // Everything into FIFO 0.
    can.write(FILTERS + 0x0C, 1).unwrap();
    can.write(FILTERS + 0x1C, 1).unwrap();
    can.write(FILTERS, 0x0E00).unwrap();
    can.write(MCR, 0).unwrap();
    can
}

fn request(can: &mut Can, mailbox: u32, id: u32) {
    let base = TX.start + 16 * mailbox;
    can.write(base + 4, 7).unwrap();
    can.write(base + 8, 0x0403_0201).unwrap();
    can.write(base + 12, 0x0007_0605).unwrap();
    can.write(base, id << 21 | 1).unwrap();
}

fn short(id: u32) -> CanFrame {
    CanFrame { id, extended: false, remote: false, length: 7, data: [1, 2, 3, 4, 5, 6, 7, 0] }
}

#[test]
fn a_frame_goes_out_in_the_time_of_its_bits() {
    let mut can = controller();
    can.write(IER, 1).unwrap();
    request(&mut can, 0, 2);
    let end = 103 * BIT;
    assert_eq!((can.next_event(), can.read(TSR).unwrap() >> 26), (end, 6));
    can.advance(end);
    assert_eq!(can.take_ended(), [(short(2), end)]);
    assert_eq!((can.read(TSR), can.interrupts()), (Ok(IDLE | RQCP | TXOK), 1));
    can.write(TSR, RQCP).unwrap();
    assert_eq!((can.read(TSR), can.interrupts()), (Ok(IDLE), 0));
}

#[test]
fn the_lowest_identifier_wins_ours_or_others() {
    let mut can = controller();
    request(&mut can, 0, 5);
    request(&mut can, 1, 4);
    request(&mut can, 2, 9);
    can.send(short(7));
    can.advance(1_000 * BIT);
    let ids: Vec<u32> = can.take_ended().iter().map(|(frame, _)| frame.id).collect();
    assert_eq!(ids, [5, 4, 9]);
    assert_eq!(can.fifos[0].state() & 3, 1);
}

#[test]
fn received_frames_wait_in_the_fifo_and_the_fourth_is_an_overrun() {
    let mut can = controller();
    can.write(IER, 2).unwrap();
    for id in 1..=4 {
        can.send(short(id));
    }
    can.advance(1_000 * BIT);
    assert_eq!((can.read(RF0R), can.interrupts()), (Ok(3 | FULL | FOVR), 2));
    assert_eq!((can.read(RX.start), can.read(RX.start + 4)), (Ok(1 << 21), Ok(7)));
    assert_eq!((can.read(RX.start + 8), can.read(RX.start + 12)), (Ok(0x0403_0201), Ok(0x0007_0605)));
    for _ in 0..3 {
        can.write(RF0R, RFOM).unwrap();
    }
    can.write(RF0R, FOVR).unwrap();
    assert_eq!((can.read(RF0R), can.interrupts()), (Ok(0), 0));
}

#[test]
fn filters_decide_what_is_kept_and_where() {
    let mut can = controller();
    can.write(FILTERS, 0x0E01).unwrap();
    // Bank 0: identifier 1 only, by list; bank 1: extended frames into FIFO 1, by mask.
    can.write(FILTERS + 0x1C, 0).unwrap();
    can.write(FILTERS + 0x04, 1).unwrap();
    can.write(FILTERS + 0x0C, 3).unwrap();
    can.write(FILTERS + 0x14, 2).unwrap();
    for (offset, value) in [(0x40, 1 << 21), (0x44, 1 << 21), (0x48, 4), (0x4C, 4)] {
        can.write(FILTERS + offset, value).unwrap();
    }
    can.write(FILTERS + 0x1C, 3).unwrap();
    can.write(FILTERS, 0x0E00).unwrap();
    can.send(short(1));
    can.send(short(2));
    can.send(CanFrame { extended: true, ..short(0x1234_5678) });
    can.advance(1_000 * BIT);
    assert_eq!((can.read(RF0R), can.read(RF1R)), (Ok(1), Ok(1)));
    assert_eq!(can.read(RX.start + 16), Ok(0x1234_5678 << 3 | 4));
}

#[test]
fn alone_on_the_bus_it_becomes_passive_and_stays_on() {
    let mut can = controller();
    can.set_bus(CanBus { inhabited: false, ..CanBus::default() });
    request(&mut can, 0, 1);
    can.advance(10_000 * BIT);
    assert_eq!(can.read(ESR), Ok(EWGF | EPVF | ACKNOWLEDGEMENT << 4 | 128 << 16));
    can.set_bus(CanBus::default());
    can.advance(11_000 * BIT);
    assert_eq!((can.take_ended().len(), can.read(ESR).unwrap() >> 16), (1, 127));
}

#[test]
fn at_the_wrong_rate_it_goes_bus_off_and_recovers() {
    let mut can = controller();
    can.set_bus(CanBus { bit_rate: 500_000, ..CanBus::default() });
    request(&mut can, 0, 1);
    can.advance(10_000 * BIT);
    assert_eq!((can.read(ESR).unwrap() & BOFF, can.read(TSR).unwrap() & 0xF), (BOFF, RQCP | TERR));
    can.set_bus(CanBus::default());
    // Through initialisation, and 128 times 11 recessive bits.
    can.write(MCR, 1 << INRQ).unwrap();
    can.write(MCR, 0).unwrap();
    assert_eq!(can.next_event(), 11_408 * BIT);
    can.advance(11_408 * BIT);
    assert_eq!(can.read(ESR).unwrap() & !0x70, 0);
    request(&mut can, 0, 1);
    can.advance(12_000 * BIT);
    assert_eq!(can.take_ended().len(), 1);
}

#[test]
fn on_shorted_wires_it_goes_bus_off_after_32_tries_and_others_wait() {
    let mut can = controller();
    can.set_bus(CanBus { shorted: true, ..CanBus::default() });
    can.write(MCR, 1 << ABOM).unwrap();
    request(&mut can, 0, 1);
    can.send(short(2));
    // A bit, and the error frame.
    let off = 32 * 21 * BIT;
    can.advance(off - 1);
    assert_eq!(can.read(ESR).unwrap(), EWGF | EPVF | DOMINANT << 4 | 248 << 16);
    can.advance(off);
    assert_eq!(can.read(ESR).unwrap() & BOFF, BOFF);
    can.set_bus(CanBus::default());
    // It recovers by itself.
    can.advance(off + RECOVERY_BITS * BIT);
    request(&mut can, 1, 3);
    can.advance(off + RECOVERY_BITS * BIT + 300 * BIT);
    assert_eq!((can.take_ended().len(), can.fifos[0].state() & 3), (1, 1));
}

/// RM0090 32.7.1: a frame that waits is called back at once; one on the bus is sent, or ends with its first failure.
#[test]
fn a_frame_is_called_back_unless_it_gets_out() {
    let mut can = controller();
    can.write(IER, 1).unwrap();
    request(&mut can, 0, 1);
    request(&mut can, 1, 2);
    can.write(TSR, ABRQ << 8).unwrap();
    assert_eq!((can.read(TSR).unwrap() & 0x1800_FF00, can.interrupts()), (0x1800_0000 | RQCP << 8, 1));
    can.write(TSR, RQCP << 8).unwrap();
    can.write(TSR, ABRQ).unwrap();
    assert_eq!(can.read(TSR).unwrap() & 0xFF, ABRQ);
    can.advance(103 * BIT);
    assert_eq!((can.take_ended(), can.read(TSR).unwrap() & 0xFF), (vec![(short(1), 103 * BIT)], RQCP | TXOK));
    can.write(TSR, RQCP).unwrap();
    can.set_bus(CanBus { inhabited: false, ..CanBus::default() });
    request(&mut can, 0, 1);
    can.write(TSR, ABRQ).unwrap();
    can.advance(300 * BIT);
    assert_eq!((can.read(TSR), can.next_event()), (Ok(IDLE | RQCP | TERR), NEVER));
    can.set_bus(CanBus::default());
    can.advance(1_000 * BIT);
    assert_eq!(can.take_ended(), []);
}

/// RM0090 32.7.2: the counter of bits runs in time triggered mode; it is read at the start of a frame.
#[test]
fn received_frames_are_stamped_in_time_triggered_mode() {
    let mut can = controller();
    for (mcr, stamps) in [(0, [0, 0]), (1 << TTCM, [1_000, 1_103])] {
        can.write(MCR, mcr).unwrap();
        let start = if mcr == 0 { 0 } else { 1_000 * BIT };
        can.advance(start);
        can.send(short(1));
        can.send(short(2));
        can.advance(start + 206 * BIT);
        for stamp in stamps {
            assert_eq!(can.read(RX.start + 4).unwrap() >> 16, stamp);
            can.write(RF0R, RFOM).unwrap();
        }
    }
}
