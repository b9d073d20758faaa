#!/usr/bin/env python3
"""Drives the virtual sisters of the TMCM-1140 with Trinamic's own PyTrinamic, unmodified: its classes for the TMCM-1110, the
TMCM-3110 and the TMCM-6110, and the demos for these modules that it brings along; and the TMCM-3212 with its class for the
TMCM-6212, which has the same parameters and more axes.

    python3 tests/clients/sisters_client.py target/debug/tmcl
    python3 tests/clients/sisters_client.py target/debug/tmcl --product 6110 \
        --image target/thumbv7em-none-eabi/release/tmcm6110

With --image the module is the flash image of the product on the emulated microcontroller. Starts `tmcl sim` itself.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import dataclasses
import importlib.metadata
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM1110, TMCM3110, TMCM6110, TMCM6212
from virtual_module import PATIENCE, Simulator, check, command_line, conclude, equal, wait_for



@dataclasses.dataclass
class Sister:
    """What a product has, and what it is driven with."""

    kind: type
    version: str
    axes: int
    # Number of inputs, and of outputs.
    inputs: int
    outputs: int
    # Analog inputs, each with the value that it has for one unit of the converter.
    analog: dict[int, int]
    # What its number is for a speed of 100 internal units at the usual divisors, about 3000 microsteps a second.
    hundred: int
    # The analog port of the supply, with what it reads at 24 V.
    supply: tuple[int, int] = (8, 240)
    # Numbers of axis parameters and of global parameters that PyTrinamic names, but firmware of this version has not yet.
    newer: tuple[int, ...] = ()
    newer_global: tuple[int, ...] = ()


SISTERS = {
    "1110": Sister(
        TMCM1110, "1110V103", 1, 4, 5, {0: 1}, 100, (1, 2707), (150, 207, 213), (78, 87, 90, 255)
    ),
    "3110": Sister(TMCM3110, "3110V114", 3, 8, 8, {0: 1, 4: 1}, 100),
    "6110": Sister(TMCM6110, "6110V146", 6, 8, 8, {0: 1, 4: 1}, 100),
    "3212": Sister(TMCM6212, "3212V105", 3, 4, 4, {0: 16, 1: 16, 2: 16, 3: 16}, 3052),
}
# Products with a demo of their own.
DEMOS = ("1110", "3110", "6110")
# Microsteps from the zero of a motor to the middle of its home switch: it is different for each.
HOME = 6000
START, STOP, STATUS = range(3)


def world(axes):
    """All axes have a home switch, further away for each."""
    switch = "[[axis]]\n[axis.stage]\nhome = [{}, {}]\n"
    return "".join(switch.format(HOME + 1000 * axis - 200, HOME + 1000 * axis + 200) for axis in range(axes))


def numbers(names):
    """The parameters that a class of PyTrinamic names."""
    return {name: number for name, number in vars(names).items() if not name.startswith("_")}


def motors(module, sister):
    """The motors of the product, of which PyTrinamic's class may have more."""
    return module.motors[: sister.axes]


def has_interrupt(name, sister):
    """True for an interrupt of the product, by its name, which has the number of the axis or input."""
    kind, number = name.split("_")
    count = {"timer": 3, "input": sister.inputs}.get(kind, sister.axes)
    return int(number) < count


def is_read(what, reader, exists=True):
    """A parameter that exists can be read, and no other one."""
    try:
        value = reader()
        check(what, exists and isinstance(value, int), value)
    except Exception as error:  # PyTrinamic has no base class for its errors.
        check(what, not exists and "Wrong Type" in str(error), repr(error))


def parameters(module, sister):
    for axis, motor in enumerate(motors(module, sister)):
        for name, number in numbers(motor.AP).items():
            what = f"axis parameter {number} {name} of {axis}"
            is_read(what, lambda: module.get_axis_parameter(number, axis), number not in sister.newer)
        # PyTrinamic's class for the TMCM-3110 lacks a parameter that it prints for stallGuard2.
        for feature in (motor, motor.drive_settings, motor.linear_ramp):
            check("settings can be printed", "{" in str(feature), feature)
    interrupts = {name: number for name, number in numbers(module.GP3).items() if has_interrupt(name, sister)}
    for bank, names, newer in ((0, numbers(module.GP0), sister.newer_global), (3, interrupts, ())):
        for name, number in names.items():
            what = f"parameter {number} {name} of bank {bank}"
            is_read(what, lambda: module.get_global_parameter(number, bank), number not in newer)


def rotor(simulator, axis):
    return simulator.control("state")["axes"][axis]["rotor"]


def rotation(module, sister, simulator):
    """All axes turn at their own speeds, and each stops alone."""
    axes = motors(module, sister)
    speeds = [(3 + axis) * sister.hundred * (-1) ** axis for axis in range(len(axes))]
    for axis, speed in enumerate(speeds):
        module.rotate(axis, speed)
    for axis, (motor, speed) in enumerate(zip(axes, speeds)):
        wait_for(f"speed of axis {axis}", lambda: motor.actual_velocity == speed)
    before = [rotor(simulator, axis) for axis in range(len(speeds))]
    simulator.let_pass(0.1)
    for axis, (start, speed) in enumerate(zip(before, speeds)):
        turned = rotor(simulator, axis) - start
        check(f"rotor {axis} turns its way", turned * speed > 0, turned)
    for axis, motor in enumerate(axes):
        module.stop(axis)
        wait_for(f"stop of axis {axis}", lambda: motor.actual_velocity == 0)
        going = [other.actual_velocity for other in axes[axis + 1 :]]
        equal(f"the others turn on after {axis}", going, speeds[axis + 1 :])


def search(module, sister, simulator):
    """All axes search their home switches at the same time."""
    connection, axes = module.connection, motors(module, sister)
    for axis, motor in enumerate(axes):
        motor.set_axis_parameter(motor.AP.ReferenceSearchMode, 7)
        motor.set_axis_parameter(motor.AP.ReferenceSearchSpeed, (20 + axis) * sister.hundred // 5)
        motor.set_axis_parameter(motor.AP.ReferenceSwitchSpeed, sister.hundred)
        # Anywhere to the left of the switch.
        module.move_to(axis, motor.actual_position - rotor(simulator, axis))
    for axis, motor in enumerate(axes):
        wait_for(f"axis {axis} is at its start", lambda: motor.get_position_reached() == 1)
    for axis in range(len(axes)):
        connection.reference_search(START, axis)
    for axis in range(len(axes)):
        check(f"axis {axis} searches", connection.reference_search(STATUS, axis) > 0)
    for axis, motor in enumerate(axes):
        wait_for(f"axis {axis} has found it", lambda: connection.reference_search(STATUS, axis) == 0)
        equal(f"axis {axis} is at zero", motor.actual_position, 0)
        off = rotor(simulator, axis) - (HOME + 1000 * axis)
        check(f"axis {axis} is at its home switch", abs(off) < 20, off)


def positioning(module, sister, simulator):
    """All axes go to their own targets at the same time."""
    axes = motors(module, sister)
    homes = [rotor(simulator, axis) for axis in range(len(axes))]
    targets = [(5000 + 3000 * axis) * (-1) ** axis for axis in range(len(axes))]
    for axis, target in enumerate(targets):
        module.move_to(axis, target, (8 + axis) * sister.hundred)
    for axis, (motor, target) in enumerate(zip(axes, targets)):
        wait_for(f"axis {axis} arrives", lambda: motor.get_position_reached() == 1)
        equal(f"position of axis {axis}", motor.actual_position, target)
    for axis, target in enumerate(targets):
        equal(f"rotor of axis {axis}", rotor(simulator, axis) - homes[axis], target)
        module.move_by(axis, -target)
    for axis, motor in enumerate(axes):
        wait_for(f"axis {axis} is back", lambda: motor.get_position_reached() == 1)
    equal("rotors", [rotor(simulator, axis) for axis in range(len(targets))], homes)


def inputs_and_outputs(module, sister, simulator):
    for port in range(sister.inputs):
        simulator.control(f"input {port} 1")
        wait_for(f"input {port}", lambda: module.get_digital_input(port) == 1)
        simulator.control(f"input {port} 0")
    for port in range(sister.outputs):
        module.set_digital_output(port)
        wait_for(f"output {port}", lambda: simulator.control("state")["outputs"][port])
        module.clear_digital_output(port)
    for port, one in sister.analog.items():
        simulator.control(f"analog {port} {1000 + port}")
        wait_for(f"analog input {port}", lambda: abs(module.get_analog_input(port) - one * (1000 + port)) <= one)
    port, reading = sister.supply
    check("supply", abs(module.get_analog_input(port) - reading) <= reading / 100)


def session(product, name, arguments, simulator):
    """All checks over one interface, with a module that has just been switched on."""
    print(f"TMCM-{product}, {name}:", flush=True)
    simulator.control("power off")
    simulator.control("power on")
    simulator.let_pass(0.3)
    sister = SISTERS[product]
    manager = ConnectionManager(f"--interface {name} {arguments} --timeout {PATIENCE}")
    with manager.connect() as connection:
        module = sister.kind(connection)
        equal("version string", connection.get_version_string(), sister.version)
        parameters(module, sister)
        inputs_and_outputs(module, sister, simulator)
        rotation(module, sister, simulator)
        search(module, sister, simulator)
        positioning(module, sister, simulator)


def sessions(product, options):
    """PyTrinamic's class for a product, over each link."""
    with tempfile.TemporaryDirectory() as folder:
        serial, rs485, slcan, config = (str(Path(folder) / name) for name in ("usb", "rs485", "slcan", "world.toml"))
        Path(config).write_text(world(SISTERS[product].axes))
        links = ("--serial", serial, "--rs485", rs485, "--slcan", slcan, "--world", config)
        simulator = Simulator(options.binary, "--product", product, *links, image=options.image)
        try:
            for name, arguments in (
                ("usb_tmcl", f"--port {serial}"),
                ("serial_tmcl", f"--port {rs485} --data-rate 9600"),
                ("slcan_tmcl", f"--port {slcan}"),
            ):
                try:
                    session(product, name, arguments, simulator)
                except Exception as error:  # One interface that fails shall not hide the others.
                    check(f"{product} {name}", False, repr(error))
        finally:
            simulator.end()


def demo(product, options):
    """The vendor's demo: some motors turn for five seconds, go as far again, and back to where they were."""
    script = f"examples/modules/TMCM{product}/TMCL/rotate_demo.py"
    path = next(file.locate() for file in importlib.metadata.files("pytrinamic") if file.as_posix() == script)
    simulator = Simulator(options.binary, "--product", product, "--tcp", "127.0.0.1:0", image=options.image)
    try:
        link = ("--interface", "socket_serial_tmcl", "--port", simulator.told["tcp"], "--timeout", str(PATIENCE))
        run = subprocess.run([sys.executable, str(path), *link], stdout=subprocess.PIPE, text=True, timeout=PATIENCE)
        equal(f"{script}: exit code", run.returncode, 0)
        check(f"{script}: to its end", run.stdout.rstrip().endswith("Ready."), run.stdout[-200:])
        told = [int(line.split("= ")[1]) for line in run.stdout.splitlines() if line.startswith("ActualPos")]
        motors = len(told) // 2
        check(f"{script}: its motors", motors == 1 if SISTERS[product].axes == 1 else motors in (2, 3), motors)
        stopped, furthest = told[:motors], told[motors:]
        # They have turned for five seconds of the host's time. Reading comes while they brake.
        check(f"{script}: they turn", all(abs(place) > 10_000 for place in stopped), stopped)
        for axis, (start, end) in enumerate(zip(stopped, furthest)):
            check(f"{script}: axis {axis} turns its way", (start > 0) == (axis != 1), start)
            check(f"{script}: axis {axis} went as far again", abs(end) > 1.9 * abs(start), (start, end))
        equal(f"{script}: all are back", [rotor(simulator, axis) for axis in range(motors)], [0] * motors)
    finally:
        simulator.end()


def main():
    options = command_line("Drives the virtual sisters of the TMCM-1140 with PyTrinamic.", tuple(SISTERS))
    with ThreadPoolExecutor() as pool:
        # The demos sleep for most of their time.
        runs = [pool.submit(demo, product, options) for product in options.products if product in DEMOS]
        for product in options.products:
            sessions(product, options)
        for running in runs:
            running.result()
    conclude()


if __name__ == "__main__":
    main()
