#!/usr/bin/env python3
"""Drives three virtual modules on one bus with Trinamic's own PyTrinamic, unmodified: over CAN and over RS485.

    python3 tests/clients/bus_client.py target/debug/tmcl
    python3 tests/clients/bus_client.py target/debug/tmcl --image target/thumbv7em-none-eabi/release/tmcm1140

With --image each module is the flash image on an emulated microcontroller.
Starts `tmcl sim` itself. Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import argparse
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM1140

PATIENCE = 180
MODULES = (1, 2, 3)
SERIAL_ADDRESS, CAN_ID = 66, 71

passed = 0
failed = 0


def equal(what, found, expected):
    """Counts a check and tells it if it fails."""
    global passed, failed
    if found == expected:
        passed += 1
    else:
        failed += 1
        print(f"FAILED: {what}: {found!r} in place of {expected!r}", flush=True)


def start(binary, image, folder):
    """Starts the simulator; gives the process and where it says it listens."""
    links = ("--rs485", f"{folder}/rs485", "--slcan", f"{folder}/slcan", "--slcan-tcp", "127.0.0.1:0")
    if image:
        links += ("--image", image)
    process = subprocess.Popen([binary, "sim", "--modules", "3", *links], stdout=subprocess.PIPE, text=True)
    told = {}
    for line in process.stdout:
        if line.strip() == "ready":
            return process, told
        name, _, value = line.strip().partition(": ")
        told.setdefault(name, value)
    sys.exit(f"{binary} did not become ready")


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
    parser = argparse.ArgumentParser(description="Drives three virtual modules on one bus with PyTrinamic.")
    parser.add_argument("binary", help="the program tmcl")
    parser.add_argument("--image", help="the flash image to be run, in place of the firmware's core")
    options = parser.parse_args()
    global failed
    with tempfile.TemporaryDirectory() as folder:
        process, told = start(options.binary, options.image, folder)
        try:
            for base, (name, arguments) in enumerate((
                ("slcan_tmcl", f"--port {told['slcan']}"),
                ("slcan_tmcl", f"--port socket://{told['slcan-tcp']}"),
                ("serial_tmcl", f"--port {told['rs485']} --data-rate 9600"),
            ), 10):
                try:
                    session(name, arguments, 100 * base)
                except Exception as error:  # One interface that fails shall not hide the others.
                    failed += 1
                    print(f"FAILED: {name}: {error!r}", flush=True)
        finally:
            process.send_signal(signal.SIGTERM)
            equal("exit code of tmcl sim", process.wait(timeout=PATIENCE), 0)
        equal("links are gone", [path for path in Path(folder).iterdir()], [])
    print(f"{passed} passed, {failed} failed")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
