//! The programs in the manual, compared with bytes that were worked out by hand.

use super::*;

fn check(source: &str, expected: &str) -> Assembly {
    let assembly = assembled(source);
    let rows = binary::encode(&assembly.commands);
    let rows: Vec<String> = rows.chunks(8).map(|row| row.iter().map(|b| format!("{b:02X} ")).collect()).collect();
    let expected: Vec<&str> = expected.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    assert_eq!(rows.iter().map(|row| row.trim()).collect::<Vec<_>>(), expected);
    assembly
}

#[test]
fn section_2_4_to_and_fro() {
    let source = "
   ROL 0, 1000 //Rotate motor 0
   WAIT TICKS, 0, 500
   MST 0
   ROR 0, 100
   WAIT TICKS, 0, 500
   MST 0

   SAP 4, 0, 100
   SAP 5, 0, 100
Loop:
   MVP ABS, 0, 512000
   WAIT POS, 0, 0
   MVP ABS, 0, -512000
   WAIT POS, 0, 0
   JA Loop //Infinite Loop";
    let expected = "
        02 00 00 00 00 03 E8 ED
        1B 00 00 00 00 01 F4 10
        03 00 00 00 00 00 00 03
        01 00 00 00 00 00 64 65
        1B 00 00 00 00 01 F4 10
        03 00 00 00 00 00 00 03
        05 04 00 00 00 00 64 6D
        05 05 00 00 00 00 64 6E
        04 00 00 00 07 D0 00 DB
        1B 01 00 00 00 00 00 1C
        04 00 00 FF F8 30 00 2B
        1B 01 00 00 00 00 00 1C
        16 00 00 00 00 00 08 1E
        1C 00 00 00 00 00 00 1C";
    assert!(check(source, expected).warnings.is_empty());
}

/// The manual writes this program with numbers; here it also has the names of the include file. It is for a module that
/// has an output 3.
#[test]
fn section_3_6_6_4_timer_interrupt() {
    let main = "
Loop:
   SIO 3, 2, 1
   WAIT TICKS, 0, 50
   SIO 3, 2, 0
   WAIT TICKS, 0, 50
   JA Loop

Timer0Irq:
   GIO 0, 2 //check if OUT0 is high
   JC NZ, Out0Off //jump if not
   SIO 0, 2, 1
   RETI
Out0Off:
   SIO 0, 2, 0
   RETI";
    let expected = "
        25 00 00 00 00 00 09 2E
        09 00 03 00 00 03 E8 F7
        19 00 00 00 00 00 00 19
        19 FF 00 00 00 00 00 18
        0E 03 02 00 00 00 01 14
        1B 00 00 00 00 00 32 4D
        0E 03 02 00 00 00 00 13
        1B 00 00 00 00 00 32 4D
        16 00 00 00 00 00 04 1A
        0F 00 02 00 00 00 00 11
        15 01 00 00 00 00 0D 23
        0E 00 02 00 00 00 01 11
        26 00 00 00 00 00 00 26
        0E 00 02 00 00 00 00 10
        26 00 00 00 00 00 00 26
        1C 00 00 00 00 00 00 1C";
    let numbers = "VECT 0, Timer0Irq //define the interrupt vector\n SGP 0, 3, 1000\n EI 0\n EI 255\n";
    let names =
        "#include Interrupts.inc\nVECT TI_TIMER0, Timer0Irq\nSGP TI_TIMER0, 3, 1000\nEI TI_TIMER0\nEI TI_GLOBAL\n";
    for head in [numbers, names] {
        let source = format!("{head}{main}");
        let warnings = check(&source, expected).warnings.0;
        let messages: Vec<String> = warnings.iter().map(|warning| warning.message.to_string()).collect();
        assert_eq!(messages, ["there is no output 3, only 0..1"; 2]);
        assert!(assemble_text("test.tmc", &source, Some(Product::Tmcm6110)).unwrap().warnings.is_empty());
    }
}

/// In this program of the manual spaces stand before colons and commas.
#[test]
fn section_3_7_20_subroutine() {
    let source = "
Loop :
   MVP ABS , 0 , 10000
   CSUB SubW //Save program counter and jump to label SubW
   MVP ABS , 0 , 0
   CSUB SubW
   JA Loop

SubW :
   WAIT POS , 0 , 0
   WAIT TICKS , 0 , 50
   RSUB";
    let expected = "
        04 00 00 00 00 27 10 3B
        17 00 00 00 00 00 05 1C
        04 00 00 00 00 00 00 04
        17 00 00 00 00 00 05 1C
        16 00 00 00 00 00 00 16
        1B 01 00 00 00 00 00 1C
        1B 00 00 00 00 00 32 4D
        18 00 00 00 00 00 00 18
        1C 00 00 00 00 00 00 1C";
    assert!(check(source, expected).warnings.is_empty());
}

/// The speeds in this program of the manual are out of range for the TMCM-1140: each gets a warning.
#[test]
fn sections_8_2_and_8_3_main_loop() {
    let numbers = "
//Initialization
  SAP 4, 0, 50000
  SAP 5, 0, 10000

MainLoop:
  MVP ABS, 0, 500000
  WAIT POS, 0, 0
  MVP ABS, 0, 0
  WAIT POS, 0, 0
  JA MainLoop";
    let names = "
//Define some constants
  #include TMCLParam.tmc
  MaxSpeed = 50000
  MaxAcc = 10000
  Position0 = 0
  Position1 = 500000

  //Initialization
  SAP APMaxPositioningSpeed, Motor0, MaxSpeed
  SAP APMaxAcceleration, Motor0, MaxAcc

MainLoop:
  MVP ABS, Motor0, Position1
  WAIT POS, Motor0, 0
  MVP ABS, Motor0, Position0
  WAIT POS, Motor0, 0
  JA MainLoop";
    let expected = "
        05 04 00 00 00 C3 50 1C
        05 05 00 00 00 27 10 41
        04 00 00 00 07 A1 20 CC
        1B 01 00 00 00 00 00 1C
        04 00 00 00 00 00 00 04
        1B 01 00 00 00 00 00 1C
        16 00 00 00 00 00 02 18
        1C 00 00 00 00 00 00 1C";
    for source in [numbers, names] {
        let warnings = check(source, expected).warnings.0;
        let messages: Vec<String> = warnings.iter().map(|warning| warning.message.to_string()).collect();
        assert_eq!(
            messages,
            [
                "50000 is out of range: maximum positioning speed takes 1..2047",
                "10000 is out of range: maximum acceleration takes 1..2047",
            ]
        );
    }
}

/// The manual has AAP instead of AGP in the last line of this program; the warnings show the mistake.
#[test]
fn section_8_4_variables() {
    let source = "
MyVariable = 42
SGP MyVariable, 2, 1234
GGP MyVariable, 2
CALC MUL, 2
AAP MyVariable, 2";
    let expected = "
        09 2A 02 00 00 04 D2 0B
        0A 2A 02 00 00 00 00 36
        13 02 00 00 00 00 02 17
        22 2A 02 00 00 00 00 4E
        1C 00 00 00 00 00 00 1C";
    let warnings = check(source, expected).warnings.to_string();
    assert!(warnings.contains("test.tmc:6:5: warning: there is no axis parameter 42"), "{warnings}");
}

#[test]
fn section_8_6_routines_for_a_host() {
    let source = "
  Func1:  JA Func1Start
  Func2:  JA Func2Start
  Func3:  JA Func3Start

Func1Start:
  MVP ABS, 0, 1000
  WAIT POS, 0, 0
  MVP ABS, 0, 0
  WAIT POS, 0, 0
  STOP

Func2Start:
  ROL 0, 500
  WAIT TICKS, 0, 100
  MST 0
  STOP

Func3Start:
  ROR 0, 1000
  WAIT TICKS, 0, 700
  MST 0
  STOP";
    let expected = "
        16 00 00 00 00 00 03 19
        16 00 00 00 00 00 08 1E
        16 00 00 00 00 00 0C 22
        04 00 00 00 00 03 E8 EF
        1B 01 00 00 00 00 00 1C
        04 00 00 00 00 00 00 04
        1B 01 00 00 00 00 00 1C
        1C 00 00 00 00 00 00 1C
        02 00 00 00 00 01 F4 F7
        1B 00 00 00 00 00 64 7F
        03 00 00 00 00 00 00 03
        1C 00 00 00 00 00 00 1C
        01 00 00 00 00 03 E8 EC
        1B 00 00 00 00 02 BC D9
        03 00 00 00 00 00 00 03
        1C 00 00 00 00 00 00 1C";
    let assembly = check(source, expected);
    let labels: Vec<_> = assembly.symbols.labels().collect();
    let addresses =
        [("Func1", 0), ("Func2", 1), ("Func3", 2), ("Func1Start", 3), ("Func2Start", 8), ("Func3Start", 12)];
    assert_eq!(labels, addresses);
}
