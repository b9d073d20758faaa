//! The last readings of a motor, which take no datagram.

/// The last readings of the motor of an axis, of its driver and of its switches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Readings {
    /// The load value of the motor, 0..=1023 (parameter 206): 0 is the largest load.
    pub load: u16,
    /// The current that coolStep gives the motor, 0..=31 (parameter 180).
    pub current: u8,
    /// The driver's flags, as the bits of parameter 208.
    pub flags: u32,
    /// The bits of the flags that mean that the driver has switched the motor off.
    pub shut_downs: u32,
    /// The driver is to be [told](super::Driver::drive) its excitation once more, because the motor stands now.
    pub waits: bool,
    /// The stop switches, left and right: true is closed, after inversion.
    pub switches: [bool; 2],
    /// An encoder whose counter is in the hardware deviates from the position further than it may.
    pub deviates: bool,
    /// The hardware has lost its registers, because of its supply. Then the motor stands, and is to be told to
    /// [stop](super::RampGenerator::stop), which sets the hardware up again.
    pub is_lost: bool,
}
