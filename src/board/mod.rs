//! The microcontroller: clocks, pins, Embassy tasks.
