use super::*;
use crate::board::{BoardKind, Input, TMCM_1140};
use crate::mcu::cpu::Bus;
use crate::world::config::WorldConfig;
use crate::world::pin::Pin;

const RCC: u32 = 0x4002_3800;
const GPIOB: u32 = 0x4002_0400;
const GPIOD: u32 = 0x4002_0C00;
const DMA2: u32 = 0x4002_6400;
const ADC1: u32 = 0x4001_2000;
const TIM4: u32 = 0x4000_0800;
const USART3_SR: u32 = 0x4000_4800;

fn soc(world: &str) -> Soc {
    wired(Board::new(&WorldConfig::parse(world).unwrap(), 0), &Pinout::TMCM_1140)
}

fn wired(board: Board, pinout: &'static Pinout) -> Soc {
    let mut soc = Soc::new(board, pinout, 0);
    soc.attach(Ram::sram());
    // Clocks of the ports, DMA2; TIM4; ADC1.
    write(&mut soc, &[(RCC + 0x30, 0x0040_001F), (RCC + 0x40, 4), (RCC + 0x44, 0x100)]);
    soc
}

fn write(soc: &mut Soc, registers: &[(u32, u32)]) {
    for &(address, value) in registers {
        soc.write(soc.now, address, 4, value);
        soc.settle(soc.now);
    }
    assert!(soc.fault.is_none(), "{:?}", soc.fault);
}

fn run(soc: &mut Soc, to: Cycles) {
    while soc.now < to {
        let due = soc.next_event().min(to);
        soc.settle(due);
    }
}

#[test]
fn what_is_not_modelled_is_a_fault() {
    let reason = |address| {
        let mut soc = soc("");
        soc.read(1, address, 4);
        let fault = soc.fault.unwrap();
        (fault.peripheral, fault.offset, fault.reason)
    };
    assert_eq!(reason(0x4001_0004).2, "this peripheral is not modelled");
    assert_eq!(reason(GPIOD + 0x30), ("GPIOD", 0x30, "this register is not modelled"));

    let mut soc = soc("");
    assert_eq!((soc.read(1, USART3_SR, 4), soc.fault.is_none()), (0, true));
    soc.write(1, USART3_SR, 4, 0);
    assert_eq!(soc.fault.unwrap().reason, "its clock is off");
}

#[test]
fn a_repeated_read_of_a_status_is_noticed_and_one_of_a_counter_is_not() {
    let mut soc = soc("");
    for _ in 0..3 {
        soc.read(1, RCC, 4);
    }
    assert!(soc.watched.is_spinning());
    for _ in 0..3 {
        soc.read(1, TIM4 + 0x24, 4);
    }
    assert!(!soc.watched.is_spinning());
}

#[test]
fn the_board_is_at_the_pins() {
    let mut soc = soc("");
    // PD10 is high, PD11 is low, and an output that is low is on. IN2 is at PD13.
    write(&mut soc, &[(GPIOD + 0x18, 1 << 10), (GPIOD, 1 << 20 | 1 << 22)]);
    assert_eq!(soc.board().world().outputs().digital, 0b10);
    soc.board_mut().change_world(|world| world.axis_mut(0).press(Pin::Right, true));
    assert_eq!(soc.read(soc.now, GPIOD + 0x10, 4) >> 8 & 0xFF, 0b0010_0100);
}

#[test]
fn another_board_is_at_other_pins() {
    // Two axes on two controllers. Chip selects at PB0 and PB1, outputs at PB4 and PB5, IN0 at PB8, home of axis 1 at
    // PB9, its SG_TST at PB10.
    static KIND: BoardKind = BoardKind { controllers: &[1, 1], inputs: &[Input::Free], ..TMCM_1140 };
    static PINOUT: Pinout = Pinout {
        selects: &[((1, 0), Chip::Tmc429(0)), ((1, 1), Chip::Tmc429(1))],
        outputs: &[(1, 4), (1, 5)],
        inputs: &[(1, 8)],
        homes: &[((1, 9), 1)],
        stalls: &[((1, 10), 1)],
        ..Pinout::TMCM_1140
    };
    let mut soc = wired(Board::of_kind(&KIND, &WorldConfig::default(), 0), &PINOUT);
    let datagrams = |soc: &Soc| [0, 1].map(|number| soc.board().datagrams(Chip::Tmc429(number)));
    // PB0, PB1, PB4, PB5 are outputs; PB0, PB1 and PB4 are high, so OUT1 alone is on.
    write(&mut soc, &[(GPIOB + 0x18, 0b01_0011), (GPIOB, 0x505)]);
    let (before, end) = (datagrams(&soc), soc.now + 1_000);
    run(&mut soc, end);
    write(&mut soc, &[(GPIOB + 0x18, 1 << 17)]);
    assert_eq!(datagrams(&soc), [before[0], before[1] + 1]);
    assert_eq!(soc.board().world().outputs().digital, 0b10);
    let inputs = |soc: &mut Soc| soc.read(soc.now, GPIOB + 0x10, 4) >> 8 & 0b111;
    soc.board_mut().change_world(|world| world.axis_mut(0).press(Pin::Home, true));
    assert_eq!(inputs(&mut soc), 0);
    soc.board_mut().change_world(|world| world.axis_mut(1).press(Pin::Home, true));
    assert_eq!(inputs(&mut soc), 0b010);
    soc.board_mut().change_world(|world| world.set_input(0, true));
    assert_eq!(inputs(&mut soc), 0b011);
}

#[test]
fn the_converter_fills_a_ring_in_memory() {
    let mut soc = soc("[supply]\nvolts = 24.0\nanalog = 1234\ntemperature = 25");
    write(
        &mut soc,
        &[
            // Stream 0, channel 0: half words, round and round, six of them.
            (DMA2 + 0x14, 6),
            (DMA2 + 0x18, ADC1 + 0x4C),
            (DMA2 + 0x1C, 0x2000_0400),
            (DMA2 + 0x10, 1 << 13 | 1 << 11 | 1 << 10 | 1 << 8 | 1),
            // Channels 10, 11 and the temperature, which takes longer.
            (ADC1 + 0x304, 1 << 23 | 1 << 16),
            (ADC1 + 0x0C, 7 << 18),
            (ADC1 + 0x2C, 2 << 20),
            (ADC1 + 0x34, 10 | 11 << 5 | 16 << 10),
            (ADC1 + 0x04, 1 << 8),
            (ADC1 + 0x08, 1 << 30 | 1 << 9 | 1 << 8 | 2 | 1),
        ],
    );
    let end = soc.now + 10_000;
    run(&mut soc, end);
    assert!(soc.fault.is_none(), "{:?}", soc.fault);
    let sram = soc.sram.clone().unwrap();
    let supply = 240 * 4095 / 363;
    let temperature = 760_000 * 4095 / 3_300_000;
    assert_eq!(sram.word(0x2000_0400), Some(1234 | supply << 16));
    assert_eq!(sram.word(0x2000_0404), Some(temperature | 1234 << 16));
    assert_eq!(sram.word(0x2000_0408), Some(supply | temperature << 16));
    assert_eq!(sram.word(0x2000_040C), Some(0xA5A5_A5A5));
}

#[test]
fn the_encoder_interface_counts_what_the_motor_turns() {
    let mut soc = soc("[abn]\nlines = 500");
    // PD12, PD13 to TIM4.
    write(&mut soc, &[(GPIOD, 0xA << 24), (GPIOD + 0x24, 0x22 << 16)]);
    write(&mut soc, &[(TIM4 + 0x08, 3), (TIM4, 1)]);
    assert_eq!(soc.read(soc.now, TIM4 + 0x24, 4), 0);
    let now = soc.board().now();
    soc.board_mut().change_world(|world| world.axis_mut(0).slip(50, now));
    assert_eq!(soc.read(soc.now, TIM4 + 0x24, 4), 500);
}

#[test]
fn the_accelerator_is_to_be_on_soon_after_the_clock_needs_wait_states() {
    const FLASH: u32 = 0x4002_3C00;
    let run_on = |acr: u32| {
        let mut soc = soc("");
        // Three wait states; the PLL gives 84 MHz from the 16 MHz inside the chip: divided by 8, times 84, by 2.
        write(&mut soc, &[(FLASH, 3), (RCC + 0x04, 7 << 24 | 84 << 6 | 8), (RCC, 1 << 24 | 1)]);
        let end = soc.now + 100_000;
        run(&mut soc, end);
        write(&mut soc, &[(RCC + 0x08, 4 << 10 | 2)]);
        let end = soc.now + 8_000;
        run(&mut soc, end);
        assert!(soc.fault.is_none(), "{:?}", soc.fault);
        write(&mut soc, &[(FLASH, acr)]);
        let end = soc.now + 8_000;
        run(&mut soc, end);
        soc.fault.map(|fault| (fault.peripheral, fault.reason))
    };
    assert_eq!(run_on(7 << 8 | 3), None);
    let complaint = Some(("FLASH", "the core runs with wait states, and prefetch or a cache is off"));
    assert_eq!(run_on(6 << 8 | 3), complaint);
    assert_eq!(run_on(3 << 8 | 3), complaint);
}

#[test]
fn wait_states_are_not_taken_away_while_the_clock_needs_them() {
    let mut soc = soc("");
    write(&mut soc, &[(0x4002_3C00, 3), (RCC + 0x04, 7 << 24 | 84 << 6 | 8), (RCC, 1 << 24 | 1)]);
    let end = soc.now + 100_000;
    run(&mut soc, end);
    write(&mut soc, &[(RCC + 0x08, 4 << 10 | 2)]);
    soc.write(soc.now, 0x4002_3C00, 4, 7 << 8 | 1);
    soc.settle(soc.now);
    assert_eq!(soc.fault.map(|fault| fault.reason), Some("too few wait states for the core clock"));
}
