#!/usr/bin/env python3
"""Drives three virtual modules on one bus with Trinamic's own PyTrinamic, unmodified: over CAN and over RS485.

    python3 tests/clients/bus_client.py target/debug/tmcl
    python3 tests/clients/bus_client.py target/debug/tmcl --image target/thumbv7em-none-eabi/release/tmcm1140

With --image each module is the flash image on an emulated microcontroller.
Starts `tmcl sim` itself. Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import tempfile
from pathlib import Path

from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM1140
from virtual_module import PATIENCE, Simulator, check, command_line, conclude, equal

MODULES = (1, 2, 3)
SERIAL_ADDRESS, CAN_ID = 66, 71


def session(name, arguments, base):
    """All checks over one interface; `base` makes its values unlike those of the others."""
    print(f"{name} {arguments}:", flush=True)
    with ConnectionManager(f"--interface {name} {arguments} --timeout {PATIENCE}").connect() as connection:
        modules = {number: TMCM1140(connection, number) for number in MODULES}
        for number in MODULES:
            reply = connection.send(136, 1, 0, 0, number)
            equal(f"module {number} answers", (reply.module_address, reply.value), (number, 0x0474012A))
            equal(f"version of module {number}", connection.get_version_string(number), "1140V142")
            for parameter in (SERIAL_ADDRESS, CAN_ID):
                equal(f"address of module {number}", modules[number].get_global_parameter(parameter, 0), number)
        for number, module in modules.items():
            module.set_axis_parameter(4, 0, base + number)
            module.set_global_parameter(number, 2, base * number)
        for turn in range(10):
            for number, module in modules.items():
                equal(f"turn {turn}: speed of module {number}", module.get_axis_parameter(4, 0), base + number)
                variable = (number + turn) % len(MODULES) + 1
                expected = base * number if variable == number else 0
                equal(f"turn {turn}: variable of module {number}", module.get_global_parameter(variable, 2), expected)
        for number, module in modules.items():
            module.motors[0].move_to(base * number)
        for number, module in modules.items():
            while not module.motors[0].get_position_reached():
                pass
            equal(f"position of module {number}", module.motors[0].actual_position, base * number)


def main():
    options = command_line("Drives three virtual modules on one bus with PyTrinamic.")
    with tempfile.TemporaryDirectory() as folder:
        links = ("--rs485", f"{folder}/rs485", "--slcan", f"{folder}/slcan", "--slcan-tcp", "127.0.0.1:0")
        simulator = Simulator(options.binary, "--modules", str(len(MODULES)), *links, image=options.image)
        try:
            for base, (name, arguments) in enumerate((
                ("slcan_tmcl", f"--port {simulator.told['slcan']}"),
                ("slcan_tmcl", f"--port socket://{simulator.told['slcan-tcp']}"),
                ("serial_tmcl", f"--port {simulator.told['rs485']} --data-rate 9600"),
            ), 10):
                try:
                    session(name, arguments, 100 * base)
                except Exception as error:  # One interface that fails shall not hide the others.
                    check(name, False, repr(error))
        finally:
            simulator.end()
        equal("links are gone", [path for path in Path(folder).iterdir()], [])
    conclude()


if __name__ == "__main__":
    main()
