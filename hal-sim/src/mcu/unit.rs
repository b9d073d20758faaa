//! The peripherals of the chip: where they are, what clocks them, which interrupts they raise (RM0090 2.3, 7.3, 12.2).

/// The buses by which RCC groups clock enables and resets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Group {
    /// AHB1, the clock of the core.
    Ahb1,
    /// AHB2, likewise.
    Ahb2,
    /// APB1, the slow one.
    Apb1,
    /// APB2, the fast one.
    Apb2,
    /// Always clocked.
    Always,
}

/// A peripheral.
#[derive(Clone, Copy, Debug)]
pub(super) struct Description {
    /// The name of the peripheral in the reference manual.
    pub(super) name: &'static str,
    /// The first address of the peripheral.
    pub(super) base: u32,
    /// The bus that clocks it.
    pub(super) group: Group,
    /// The peripheral's bit in the enable and reset registers of that bus.
    pub(super) bit: u32,
    /// Numbers of its interrupts.
    pub(super) interrupts: &'static [u16],
}

/// Bytes of address space of a peripheral.
pub(super) const SIZE: u32 = 0x400;

macro_rules! units {
    ($($unit:ident $name:literal $base:literal $group:ident $bit:literal [$($irq:literal),*];)*) => {
        /// Names a peripheral.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(super) enum PeripheralName {
            $(#[doc = $name] $unit,)*
        }

        impl PeripheralName {
            /// All of them, in the order of their values.
            pub(super) const ALL: [PeripheralName; [$(PeripheralName::$unit),*].len()] = [$(PeripheralName::$unit),*];

            /// Gives what there is to know about the peripheral.
            pub(super) const fn description(self) -> Description {
                match self {
                    $(PeripheralName::$unit => Description {
                        name: $name, base: $base, group: Group::$group, bit: $bit, interrupts: &[$($irq),*],
                    },)*
                }
            }
        }
    };
}

units! {
    GpioA "GPIOA" 0x4002_0000 Ahb1 0 [];
    GpioB "GPIOB" 0x4002_0400 Ahb1 1 [];
    GpioC "GPIOC" 0x4002_0800 Ahb1 2 [];
    GpioD "GPIOD" 0x4002_0C00 Ahb1 3 [];
    GpioE "GPIOE" 0x4002_1000 Ahb1 4 [];
    Rcc "RCC" 0x4002_3800 Always 0 [];
    Flash "FLASH" 0x4002_3C00 Always 0 [];
    Dma1 "DMA1" 0x4002_6000 Ahb1 21 [11, 12, 13, 14, 15, 16, 17, 47];
    Dma2 "DMA2" 0x4002_6400 Ahb1 22 [56, 57, 58, 59, 60, 68, 69, 70];
    Tim2 "TIM2" 0x4000_0000 Apb1 0 [28];
    Tim3 "TIM3" 0x4000_0400 Apb1 1 [29];
    Tim4 "TIM4" 0x4000_0800 Apb1 2 [30];
    Tim5 "TIM5" 0x4000_0C00 Apb1 3 [50];
    Iwdg "IWDG" 0x4000_3000 Always 0 [];
    Spi2 "SPI2" 0x4000_3800 Apb1 14 [36];
    Spi3 "SPI3" 0x4000_3C00 Apb1 15 [51];
    Usart2 "USART2" 0x4000_4400 Apb1 17 [38];
    Usart3 "USART3" 0x4000_4800 Apb1 18 [39];
    Can1 "CAN1" 0x4000_6400 Apb1 25 [19, 20, 21, 22];
    Pwr "PWR" 0x4000_7000 Apb1 28 [];
    Usart1 "USART1" 0x4001_1000 Apb2 4 [37];
    Adc1 "ADC1" 0x4001_2000 Apb2 8 [18];
    Spi1 "SPI1" 0x4001_3000 Apb2 12 [35];
    Syscfg "SYSCFG" 0x4001_3800 Apb2 14 [];
    Exti "EXTI" 0x4001_3C00 Always 0 [6, 7, 8, 9, 10, 23, 40];
    OtgFs "OTG_FS" 0x5000_0000 Ahb2 7 [67];
    Dbgmcu "DBGMCU" 0xE004_2000 Always 0 [];
}

impl PeripheralName {
    /// The number of a port: 0 is A.
    pub(super) const fn port(self) -> Option<usize> {
        match self {
            PeripheralName::GpioA
            | PeripheralName::GpioB
            | PeripheralName::GpioC
            | PeripheralName::GpioD
            | PeripheralName::GpioE => Some(self as usize),
            _ => None,
        }
    }

    /// Whether its registers change only with events: not so counters, and pins that the board drives.
    #[inline]
    pub(super) fn changes_by_events(self) -> bool {
        self.port().is_none()
            && !matches!(
                self,
                PeripheralName::Tim2 | PeripheralName::Tim3 | PeripheralName::Tim4 | PeripheralName::Tim5
            )
    }

    /// Whether an access to it may change the levels that the external interrupt lines see: by what it drives, selects
    /// on the board, or chooses to look at. What others do to a pin takes an event of the board.
    #[inline]
    pub(super) fn decides_on_pins(self) -> bool {
        self.port().is_some() || matches!(self, PeripheralName::Exti | PeripheralName::Rcc | PeripheralName::Syscfg)
    }
}

/// A set of peripherals, taken out one by one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Units(u64);

impl Units {
    /// All there are.
    pub(super) const ALL: Self = Self((1 << PeripheralName::ALL.len()) - 1);

    /// Puts a peripheral in.
    #[inline]
    pub(super) fn insert(&mut self, unit: PeripheralName) {
        self.0 |= 1 << unit as u32;
    }

    /// Puts all in but one, which stays as it is.
    pub(super) fn insert_all_but(&mut self, unit: PeripheralName) {
        self.0 |= Self::ALL.0 & !(1 << unit as u32);
    }

    /// Whether there is none in it.
    #[inline]
    pub(super) fn is_empty(self) -> bool {
        self.0 == 0
    }
}

impl Iterator for Units {
    type Item = PeripheralName;

    #[inline]
    fn next(&mut self) -> Option<PeripheralName> {
        let unit = PeripheralName::ALL.get(self.0.trailing_zeros() as usize).copied()?;
        self.0 &= self.0 - 1;
        Some(unit)
    }
}

/// Bytes of address space of OTG_FS, with its FIFOs.
const OTG_SIZE: u32 = 0x4_0000;

/// Where the peripherals lie densely, one every [`SIZE`] bytes.
const FIRST: u32 = 0x4000_0000;
const PAGES: usize = 0xA0;

/// Finds the peripheral at an address.
#[derive(Debug)]
pub(super) struct Decoder([Option<PeripheralName>; PAGES]);

impl Decoder {
    pub(super) fn new() -> Self {
        let mut pages = [None; PAGES];
        for unit in PeripheralName::ALL {
            if let Some(page) = Self::page(unit.description().base).and_then(|page| pages.get_mut(page)) {
                *page = Some(unit);
            }
        }
        Self(pages)
    }

    fn page(address: u32) -> Option<usize> {
        address.checked_sub(FIRST).map(|distance| (distance / SIZE) as usize)
    }

    /// The peripheral that `address` belongs to, and the offset in it.
    pub(super) fn find(&self, address: u32) -> Option<(PeripheralName, u32)> {
        let dense = Self::page(address).and_then(|page| self.0.get(page));
        if let Some(unit) = dense {
            return unit.map(|unit| (unit, address % SIZE));
        }
        let far = [(PeripheralName::OtgFs, OTG_SIZE), (PeripheralName::Dbgmcu, SIZE)];
        far.into_iter().find_map(|(unit, size)| {
            let offset = address.checked_sub(unit.description().base)?;
            (offset < size).then_some((unit, offset))
        })
    }
}
