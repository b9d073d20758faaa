//! The registers of the TMC5160 and their bits (TMC5160 datasheet, chapter 6), as far as the firmware uses them.

use crate::chip::REPEATS;

/// The registers, by address (datasheet chapter 6). Speeds are in 2^-24 microsteps per clock, accelerations in 2^-41
/// microsteps per square of a clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Register {
    /// General configuration, see [`gconf`].
    Gconf = 0x00,
    /// The events since the firmware looked last, see [`gstat`]: a one that is written clears its flag.
    Gstat = 0x01,
    /// Levels of pins, and in bits 31..24 the version.
    Ioin = 0x04,
    /// Scale of the motor current, in 1/256; 0 is the full scale.
    GlobalScaler = 0x0B,
    /// Standstill current in bits 4..0, run current in 12..8, both in 1/32 less one, and in 19..16 the delay between
    /// two steps of the power down ramp.
    IholdIrun = 0x10,
    /// Time from standstill to the power down ramp, in 2^18 clocks.
    TPowerDown = 0x11,
    /// Clocks in 1/256 of a full step, as measured; 2^20 - 1 at standstill.
    TStep = 0x12,
    /// stealthChop works while TSTEP is not below this.
    TPwmThrs = 0x13,
    /// coolStep and stop on stall work while TSTEP is not above this.
    TCoolThrs = 0x14,
    /// The chopper is in its mode for high speeds while TSTEP is not above this.
    THigh = 0x15,
    /// How the ramp generator moves, see [`RampMode`].
    RampMode = 0x20,
    /// Actual position in microsteps, signed.
    XActual = 0x21,
    /// Actual speed, signed, 24 bits.
    VActual = 0x22,
    /// Speed at which a motor starts.
    VStart = 0x23,
    /// Acceleration between VSTART and V1.
    A1 = 0x24,
    /// Speed at which the other acceleration and deceleration begin; 0: they hold everywhere.
    V1 = 0x25,
    /// Acceleration above V1, and in velocity mode everywhere.
    AMax = 0x26,
    /// Top speed of positioning, target speed in velocity mode.
    VMax = 0x27,
    /// Deceleration above V1.
    DMax = 0x28,
    /// Deceleration between V1 and VSTOP.
    D1 = 0x2A,
    /// Speed at which a motor stops.
    VStop = 0x2B,
    /// Time at a stand before the next move, in 512 clocks.
    TZeroWait = 0x2C,
    /// Target position in microsteps, signed. In positioning mode a write sets the motor going.
    XTarget = 0x2D,
    /// Speed above which dcStep works; 0: nowhere.
    VdcMin = 0x33,
    /// The effects of switches and stalls, see [`sw_mode`].
    SwMode = 0x34,
    /// State of ramp and switches, see [`ramp_stat`]: a one that is written clears a flag of an event.
    RampStat = 0x35,
    /// The position that a switch has latched.
    XLatch = 0x36,
    /// Mode of the encoder.
    EncMode = 0x38,
    /// Position of the encoder.
    XEnc = 0x39,
    /// By what each count of the encoder changes its position, as a fixed point number of 16.16 bits.
    EncConst = 0x3A,
    /// Events of the encoder, see [`enc_status`]: a one that is written clears its flag.
    EncStatus = 0x3B,
    /// The position of the encoder that was latched.
    EncLatch = 0x3C,
    /// How far the encoder may deviate from the position, in microsteps; 0: anywhere.
    EncDeviation = 0x3D,
    /// Configuration of the chopper.
    ChopConf = 0x6C,
    /// Configuration of stallGuard2 and coolStep.
    CoolConf = 0x6D,
    /// Configuration of dcStep.
    DcCtrl = 0x6E,
    /// State of the driver, see [`drv_status`].
    DrvStatus = 0x6F,
    /// Configuration of stealthChop.
    PwmConf = 0x70,
    /// Duty cycle of stealthChop, in bits 7..0.
    PwmScale = 0x71,
}

impl Register {
    /// How often a write to the register is repeated whose answer is lost: it may have reached the chip all the same. A
    /// second write to a position would lose the steps, or the counts, since the first, and one to a register of flags
    /// would clear those that have come since. No reading changes anything.
    pub(super) const fn repeats(self) -> u8 {
        match self {
            Register::XActual | Register::XEnc | Register::Gstat | Register::RampStat | Register::EncStatus => 0,
            _ => REPEATS,
        }
    }
}

/// Bits of [`Register::Gconf`].
pub mod gconf {
    /// en_pwm_mode: stealthChop is switched on, which is allowed at standstill only.
    pub const EN_PWM_MODE: u32 = 1 << 2;
    /// multistep_filt: the filter of the step input, which is on after a reset.
    pub const MULTISTEP_FILT: u32 = 1 << 3;
    /// shaft: the motor turns the other way.
    pub const SHAFT: u32 = 1 << 4;
}

/// Bits of [`Register::Gstat`].
pub mod gstat {
    /// reset: the registers are at their reset values.
    pub const RESET: u32 = 1 << 0;
    /// drv_err: the driver has shut down.
    pub const DRV_ERR: u32 = 1 << 1;
}

/// Bits of [`Register::SwMode`].
pub mod sw_mode {
    /// stop_l_enable: the left switch stops the motor.
    pub const STOP_L_ENABLE: u32 = 1 << 0;
    /// stop_r_enable: the right switch stops the motor.
    pub const STOP_R_ENABLE: u32 = 1 << 1;
    /// pol_stop_l: the left switch is closed at a low level.
    pub const POL_STOP_L: u32 = 1 << 2;
    /// pol_stop_r: the right switch is closed at a low level.
    pub const POL_STOP_R: u32 = 1 << 3;
    /// swap_lr: left and right are swapped.
    pub const SWAP_LR: u32 = 1 << 4;
    /// latch_l_active: the position is latched when the left switch closes.
    pub const LATCH_L_ACTIVE: u32 = 1 << 5;
    /// latch_l_inactive: the position is latched when the left switch opens.
    pub const LATCH_L_INACTIVE: u32 = 1 << 6;
    /// latch_r_active: the position is latched when the right switch closes.
    pub const LATCH_R_ACTIVE: u32 = 1 << 7;
    /// latch_r_inactive: the position is latched when the right switch opens.
    pub const LATCH_R_INACTIVE: u32 = 1 << 8;
    /// en_latch_encoder: the encoder's position is latched together with the motor's.
    pub const EN_LATCH_ENCODER: u32 = 1 << 9;
    /// sg_stop: a stall stops the motor.
    pub const SG_STOP: u32 = 1 << 10;
    /// en_softstop: switches stop the motor along the ramp.
    pub const EN_SOFTSTOP: u32 = 1 << 11;
}

/// Bits of [`Register::RampStat`].
pub mod ramp_stat {
    /// status_stop_l: the left switch is closed.
    pub const STOP_L: u32 = 1 << 0;
    /// status_stop_r: the right switch is closed.
    pub const STOP_R: u32 = 1 << 1;
    /// status_latch_l and status_latch_r: a position has been latched.
    pub const LATCHES: u32 = 0b11 << 2;
    /// event_stop_sg: a stall has stopped the motor.
    pub const EVENT_STOP_SG: u32 = 1 << 6;
}

/// Bits of [`Register::EncStatus`].
pub mod enc_status {
    /// deviation_warn: the encoder deviates too far.
    pub const DEVIATION_WARN: u32 = 1 << 1;
}

/// Fields of [`Register::DrvStatus`].
pub mod drv_status {
    /// SG_RESULT: the load value.
    pub const SG_RESULT: u32 = 0x3FF;
    /// s2vsa and s2vsb, of which the first one is this bit: a short to the supply.
    pub const S2VSA_BIT: u32 = 12;
    /// stealth: stealthChop drives the motor.
    pub const STEALTH: u32 = 1 << 14;
    /// CS_ACTUAL, from this bit on, five bits: the current scale.
    pub const CS_ACTUAL_BIT: u32 = 16;
    /// StallGuard, from this bit on, and seven more flags up to stst.
    pub const FLAGS_BIT: u32 = 24;
}

/// How the ramp generator moves ([`Register::RampMode`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum RampMode {
    /// To XTARGET.
    Positioning = 0,
    /// At VMAX, towards positive positions.
    Positive = 1,
    /// At VMAX, towards negative positions.
    Negative = 2,
    /// On at the speed that the motor has.
    Hold = 3,
}
