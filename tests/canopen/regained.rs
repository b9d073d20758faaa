//! The ways out of lost settings, as masters go them: a whole list that is downloaded, a save, a restart; and what is
//! none.

use hal_sim::board::{self, Board, SharedBoard};
use hal_sim::world::config::WorldConfig;
use tmcm::canopen::{Access, Address, ROWS, When};

use crate::driving::{FAULT, FAULT_RESET, SWITCH_ON_DISABLED};
use crate::lost_settings::{PAGE, SETTINGS, flipped, page_of, saved, told};
use crate::rig::Rig;

/// The address that is saved.
const NINE: Address = Address { node: 9, bit_rate: 500 };
/// Not in the present state of the device.
const STATE: u32 = 0x0800_0022;

/// A node whose page with this number cannot be read, and the objects in it.
fn lost(eeprom: &[u8], page: usize) -> (Rig, Vec<(u16, u8)>) {
    let mut rig = Rig::with_eeprom(&flipped(eeprom, page, 99, &[0, 1]), 1);
    rig.wait(3);
    let [.., low, high, sub] = told(&mut rig)[0][..] else { panic!("nothing is told") };
    let list = page_of((u16::from_le_bytes([low, high]), sub));
    (rig, list)
}

fn reset_fault(rig: &mut Rig) -> u32 {
    rig.word(0);
    rig.word(FAULT_RESET);
    rig.drive_state()
}

/// A node that runs as node 9, and whose EEPROM is exchanged under it before a restart.
fn restarted_on(change: impl Fn(&mut SharedBoard)) -> Rig {
    let mut board = Board::of_kind(&board::TMCM_1140, &WorldConfig::default(), 1);
    board.at25_mut().load(&saved());
    let mut board = SharedBoard::new(board);
    let mut rig = Rig::on(&board, false);
    rig.wait(200);
    rig.frames();
    change(&mut board);
    rig.command(0x81);
    rig.wait(100);
    assert_eq!((rig.node.address(), rig.drive_state()), (Some(NINE), FAULT));
    rig
}

/// A master that downloads its list writes all its objects, those too whose values are there, and some twice.
#[test]
fn a_whole_list_is_taken_in_the_fault() {
    let eeprom = saved();
    for page in 1..9 {
        let (mut rig, _) = lost(&eeprom, page);
        let in_disabled = ROWS.iter().filter(|row| row.when == When::Disabled && row.access == Access::Rw);
        for row in in_disabled.clone().chain(in_disabled) {
            let value = rig.read(row.first, row.sub);
            assert_eq!(rig.write(row.first, row.sub, value), Ok(()), "page {page}: {:04X}h.{}", row.first, row.sub);
        }
        assert_eq!(rig.drive_state(), FAULT);
    }
}

/// The microsteps of a turn, on which velocities in rpm depend, are lost with their page.
#[test]
fn a_page_of_a_drive_in_rpm_is_replaced() {
    let mut rig = Rig::new();
    rig.set(0x2705, 0, 9);
    rig.set(0x208C, 0, 164);
    rig.sign(0x1010, 1, b"save").unwrap();
    rig.wait(200);
    let (mut rig, list) = lost(&rig.eeprom(), 5);
    assert!(list.contains(&(0x2000, 0)) && rig.read(0x208C, 0) == 164, "{list:04X?}");
    for (index, sub) in list {
        let value = rig.read(index, sub);
        assert_eq!(rig.write(index, sub, value), Ok(()), "{index:04X}h.{sub}");
    }
    rig.wait(3);
    assert_eq!(reset_fault(&mut rig), SWITCH_ON_DISABLED);
}

/// An EEPROM that stays silent is asked again each second, and each time has nothing to say: that gives no settings
/// back.
#[test]
fn a_silent_eeprom_gives_nothing_back() {
    let mut rig = restarted_on(|board| board.borrow_mut().set_fault(hal_sim::fault::Fault::Eeprom, 0, true));
    for second in 0..5 {
        rig.wait(1_000);
        assert_eq!(reset_fault(&mut rig), FAULT, "after {second} s");
        assert_eq!((rig.read(0x603F, 0), rig.read(0x1001, 0)), (0x5530, 0x81));
    }
    assert_eq!((rig.read(0x2705, 0), rig.read(0x2704, 0)), (9, 500), "what the next start would have");
}

/// Node ID and bit rate are lost while the node runs: a restart keeps them, and so does whatever is saved then.
#[test]
fn a_save_keeps_the_number_that_a_restart_has_kept() {
    for (sub, is_erased) in [(1, false), (2, true), (4, false)] {
        let mut lost = flipped(&saved(), 0, 99, &[0, 1]);
        // One copy may also hold nothing at all.
        if is_erased {
            lost[SETTINGS..][..PAGE].fill(0xFF);
        }
        let mut rig = restarted_on(|board| board.borrow_mut().at25_mut().load(&lost));
        assert_eq!((rig.read(0x2705, 0), rig.read(0x2704, 0)), (9, 500));
        // Its page says what belongs to it: nothing is taken from the others.
        assert_eq!((rig.read(0x2003, 0), rig.read(0x607D, 2)), (128, i32::MAX as u32));
        rig.sign(0x1010, sub, b"save").unwrap();
        rig.wait(200);
        rig.power_cycle();
        rig.wait(100);
        assert_eq!(rig.node.address(), Some(NINE), "1010h.{sub}");
    }
    // The factory's settings of the motor leave it as well; those of all are asked for with node 1 in them.
    for (sub, address) in [(4, NINE), (1, Address::DEFAULT)] {
        let lost = flipped(&saved(), 0, 99, &[0, 1]);
        let mut rig = restarted_on(|board| board.borrow_mut().at25_mut().load(&lost));
        rig.sign(0x1011, sub, b"load").unwrap();
        rig.wait(200);
        rig.power_cycle();
        rig.wait(100);
        assert_eq!(rig.node.address(), Some(address), "1011h.{sub}");
    }
}

/// The bridges would come on with a current that nobody has chosen.
#[test]
fn tmcl_mode_has_to_wait() {
    let (mut rig, list) = lost(&saved(), 5);
    assert_eq!(rig.write(0x2700, 0, u32::from_le_bytes(*b"make")), Err(STATE));
    assert!(!rig.is_energised());
    for (index, sub) in list {
        let value = rig.read(index, sub);
        rig.set(index, sub, value);
    }
    rig.set(0x2700, 0, u32::from_le_bytes(*b"make"));
    rig.wait(100);
    assert!(rig.is_energised());
}

/// A reset of communication takes the objects of communication from the EEPROM, which has lost them: what was written
/// to them is gone, and so is the way out.
#[test]
fn a_reset_of_communication_loses_them_again() {
    for page in 1..=3 {
        let (mut rig, list) = lost(&saved(), page);
        for pdo in [0x1400, 0x1800].into_iter().flat_map(|first| first..first + 4) {
            let cob_id = rig.read(pdo, 1);
            rig.set(pdo, 1, cob_id | 1 << 31);
            rig.set(pdo + 0x200, 0, 0);
        }
        for (index, sub) in &list {
            let value = rig.read(*index, *sub);
            rig.set(*index, *sub, value);
        }
        let is_communication = list.iter().any(|(index, _)| *index < 0x2000);
        assert!(is_communication, "{list:04X?}");
        rig.command(0x82);
        rig.wait(3);
        assert_eq!(reset_fault(&mut rig), FAULT, "page {page}");
        rig.sign(0x1010, 1, b"save").unwrap();
        rig.wait(200);
        assert_eq!(reset_fault(&mut rig), SWITCH_ON_DISABLED, "page {page}");
    }
}
