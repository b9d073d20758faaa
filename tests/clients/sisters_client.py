#!/usr/bin/env python3
"""Drives the virtual sisters with several axes with Trinamic's own PyTrinamic, unmodified: its classes for the TMCM-3110 and
the TMCM-6110, and the demos for these modules that it brings along.

    python3 tests/clients/sisters_client.py target/debug/tmcl
    python3 tests/clients/sisters_client.py target/debug/tmcl --image target/thumbv7em-none-eabi/release/tmcm6110

With --image the module is the flash image of the TMCM-6110 on the emulated microcontroller. Starts `tmcl sim` itself.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import importlib.metadata
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM3110, TMCM6110
from virtual_module import PATIENCE, Simulator, check, command_line, conclude, equal, wait_for

MODULES = {"3110": (TMCM3110, "3110V114"), "6110": (TMCM6110, "6110V146")}
# Microsteps from the zero of a motor to the middle of its home switch: it is different for each.
HOME = 6000
# All axes have a home switch, further away for each.
WORLD = "".join(
    f"[[axis]]\n[axis.stage]\nhome = [{HOME + 1000 * axis - 200}, {HOME + 1000 * axis + 200}]\n" for axis in range(6)
)
START, STOP, STATUS = range(3)


def numbers(names):
    """The parameters that a class of PyTrinamic names."""
    return {name: number for name, number in vars(names).items() if not name.startswith("_")}


def is_read(what, reader):
    """A parameter that exists can be read."""
    try:
        value = reader()
        check(what, isinstance(value, int), value)
    except Exception as error:  # PyTrinamic has no base class for its errors.
        check(what, False, repr(error))


def parameters(module):
    for axis, motor in enumerate(module.motors):
        for name, number in numbers(motor.AP).items():
            is_read(f"axis parameter {number} {name} of {axis}", lambda: module.get_axis_parameter(number, axis))
        # PyTrinamic's class for the TMCM-3110 lacks a parameter that it prints for stallGuard2.
        for feature in (motor, motor.drive_settings, motor.linear_ramp):
            check("settings can be printed", "{" in str(feature), feature)
    for bank, names in ((0, module.GP0), (3, module.GP3)):
        for name, number in numbers(names).items():
            is_read(f"parameter {number} {name} of bank {bank}", lambda: module.get_global_parameter(number, bank))


def rotor(simulator, axis):
    return simulator.control("state")["axes"][axis]["rotor"]


def rotation(module, simulator):
    """All axes turn at their own speeds, and each stops alone."""
    speeds = [(300 + 100 * axis) * (-1) ** axis for axis in range(len(module.motors))]
    for axis, speed in enumerate(speeds):
        module.rotate(axis, speed)
    for axis, (motor, speed) in enumerate(zip(module.motors, speeds)):
        wait_for(f"speed of axis {axis}", lambda: motor.actual_velocity == speed)
    before = [rotor(simulator, axis) for axis in range(len(speeds))]
    simulator.let_pass(0.1)
    for axis, (start, speed) in enumerate(zip(before, speeds)):
        turned = rotor(simulator, axis) - start
        check(f"rotor {axis} turns its way", turned * speed > 0, turned)
    for axis, motor in enumerate(module.motors):
        module.stop(axis)
        wait_for(f"stop of axis {axis}", lambda: motor.actual_velocity == 0)
        going = [other.actual_velocity for other in module.motors[axis + 1 :]]
        equal(f"the others turn on after {axis}", going, speeds[axis + 1 :])


def search(module, simulator):
    """All axes search their home switches at the same time."""
    connection = module.connection
    for axis, motor in enumerate(module.motors):
        motor.set_axis_parameter(motor.AP.ReferenceSearchMode, 7)
        motor.set_axis_parameter(motor.AP.ReferenceSearchSpeed, 400 + 20 * axis)
        # Anywhere to the left of the switch.
        module.move_to(axis, motor.actual_position - rotor(simulator, axis))
    for axis, motor in enumerate(module.motors):
        wait_for(f"axis {axis} is at its start", lambda: motor.get_position_reached() == 1)
    for axis in range(len(module.motors)):
        connection.reference_search(START, axis)
    for axis in range(len(module.motors)):
        check(f"axis {axis} searches", connection.reference_search(STATUS, axis) > 0)
    for axis, motor in enumerate(module.motors):
        wait_for(f"axis {axis} has found it", lambda: connection.reference_search(STATUS, axis) == 0)
        equal(f"axis {axis} is at zero", motor.actual_position, 0)
        off = rotor(simulator, axis) - (HOME + 1000 * axis)
        check(f"axis {axis} is at its home switch", abs(off) < 20, off)


def positioning(module, simulator):
    """All axes go to their own targets at the same time."""
    homes = [rotor(simulator, axis) for axis in range(len(module.motors))]
    targets = [(5000 + 3000 * axis) * (-1) ** axis for axis in range(len(module.motors))]
    for axis, target in enumerate(targets):
        module.move_to(axis, target, 800 + 100 * axis)
    for axis, (motor, target) in enumerate(zip(module.motors, targets)):
        wait_for(f"axis {axis} arrives", lambda: motor.get_position_reached() == 1)
        equal(f"position of axis {axis}", motor.actual_position, target)
    for axis, target in enumerate(targets):
        equal(f"rotor of axis {axis}", rotor(simulator, axis) - homes[axis], target)
        module.move_by(axis, -target)
    for axis, motor in enumerate(module.motors):
        wait_for(f"axis {axis} is back", lambda: motor.get_position_reached() == 1)
    equal("rotors", [rotor(simulator, axis) for axis in range(len(targets))], homes)


def inputs_and_outputs(module, simulator):
    for port in range(8):
        simulator.control(f"input {port} 1")
        wait_for(f"input {port}", lambda: module.get_digital_input(port) == 1)
        module.set_digital_output(port)
        wait_for(f"output {port}", lambda: simulator.control("state")["outputs"][port])
        simulator.control(f"input {port} 0")
        module.clear_digital_output(port)
    for port in (0, 4):
        simulator.control(f"analog {port} {1000 + port}")
        wait_for(f"analog input {port}", lambda: abs(module.get_analog_input(port) - 1000 - port) <= 1)
    check("supply", abs(module.get_analog_input(8) - 240) <= 1)


def session(product, name, arguments, simulator):
    """All checks over one interface, with a module that has just been switched on."""
    print(f"TMCM-{product}, {name}:", flush=True)
    simulator.control("power off")
    simulator.control("power on")
    simulator.let_pass(0.3)
    kind, version = MODULES[product]
    manager = ConnectionManager(f"--interface {name} {arguments} --timeout {PATIENCE}")
    with manager.connect() as connection:
        module = kind(connection)
        equal("version string", connection.get_version_string(), version)
        parameters(module)
        inputs_and_outputs(module, simulator)
        rotation(module, simulator)
        search(module, simulator)
        positioning(module, simulator)


def sessions(product, options):
    """PyTrinamic's class for a product, over each link."""
    with tempfile.TemporaryDirectory() as folder:
        serial, rs485, slcan, world = (str(Path(folder) / name) for name in ("usb", "rs485", "slcan", "world.toml"))
        axes = 6 if product == "6110" else 3
        Path(world).write_text("[[axis]]".join(WORLD.split("[[axis]]")[: axes + 1]))
        links = ("--serial", serial, "--rs485", rs485, "--slcan", slcan, "--world", world)
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
        told = [int(line.split("= ")[1]) for line in run.stdout.splitlines() if line.startswith("ActualPostion")]
        motors = len(told) // 2
        check(f"{script}: some motors", motors in (2, 3), motors)
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
    options = command_line("Drives the virtual sisters with several axes with PyTrinamic.")
    products = ["6110"] if options.image else list(MODULES)
    with ThreadPoolExecutor() as pool:
        # The demos sleep for most of their time.
        runs = [pool.submit(demo, product, options) for product in products]
        for product in products:
            sessions(product, options)
        for running in runs:
            running.result()
    conclude()


if __name__ == "__main__":
    main()
