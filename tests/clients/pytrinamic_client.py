#!/usr/bin/env python3
"""Drives the virtual module with Trinamic's own PyTrinamic, unmodified, over every interface it has for one.

    python3 tests/clients/pytrinamic_client.py target/debug/tmcl
    python3 tests/clients/pytrinamic_client.py target/debug/tmcl --image target/thumbv7em-none-eabi/release/tmcm1140

With --image the module is the flash image on the emulated microcontroller. Starts `tmcl sim` itself.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import re
import tempfile
from pathlib import Path

from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM1140
from pytrinamic.tmcl import TMCLCommand
from virtual_module import PATIENCE, Simulator, check, command_line, conclude, equal, wait_for

TOUR = Path(__file__).parents[2] / "docs" / "tour.md"
# Longest time that a module takes to start, in seconds of its own time.
START = 0.3
# An internal speed at which stallGuard2 has something to measure.
SPEED = 800


def numbers(names):
    """The parameters that a class of PyTrinamic names."""
    return {name: number for name, number in vars(names).items() if not name.startswith("_")}


def versions(connection):
    equal("version string", connection.get_version_string(), "1140V142")
    value = connection.send(TMCLCommand.GET_FIRMWARE_VERSION, 1, 0, 0).value
    equal("version number", (value >> 16, value >> 8 & 0xFF, value & 0xFF), (1140, 1, 42))


def read(what, reader):
    """A parameter that exists can be read."""
    try:
        value = reader()
        check(what, isinstance(value, int), value)
    except Exception as error:  # PyTrinamic has no base class for its errors.
        check(what, False, repr(error))


def parameters(module):
    for name, number in numbers(module.motors[0].AP).items():
        read(f"axis parameter {number} {name}", lambda: module.get_axis_parameter(number, 0))
    for bank, names in ((0, module.GP0), (3, module.GP3)):
        for name, number in numbers(names).items():
            read(f"parameter {number} {name} of bank {bank}", lambda: module.get_global_parameter(number, bank))


def settings(motor):
    for feature in (motor, motor.drive_settings, motor.linear_ramp, motor.stallguard2, motor.coolstep):
        text = str(feature)
        print(f"    {text}")
        check("settings can be printed", "{" in text, text)


def inputs_and_outputs(module, simulator):
    # What is measured may be off by a step of the converter.
    supply, temperature = module.get_analog_input(8), module.get_analog_input(9)
    check("supply", abs(supply - 240) <= 1, supply)
    check("temperature", abs(temperature - 25) <= 1, temperature)
    simulator.control("press left")
    wait_for("the switch is seen", lambda: module.get_digital_input(module.IO.IN1) == 1)
    equal("left stop switch", module.get_axis_parameter(module.motors[0].AP.LeftEndstop, 0), 1)
    simulator.control("release left")
    wait_for("the switch is released", lambda: module.get_digital_input(module.IO.IN1) == 0)
    module.set_digital_output(module.IO.OUT1)
    wait_for("output on", lambda: simulator.control("state")["outputs"] == [False, True])
    module.clear_digital_output(module.IO.OUT1)
    wait_for("output off", lambda: simulator.control("state")["outputs"] == [False, False])


def rotation(module, simulator):
    motor = module.motors[0]
    for name, speed in (("right", SPEED), ("left", -SPEED)):
        start = simulator.control("state")["rotor"]
        motor.rotate(speed)
        wait_for(f"speed to the {name}", lambda: motor.actual_velocity == speed)
        equal(f"target speed to the {name}", motor.target_velocity, speed)
        motor.stop()
        wait_for(f"stop from the {name}", lambda: motor.actual_velocity == 0)
        turned = simulator.control("state")["rotor"] - start
        check(f"rotor turned to the {name}", turned * speed > 0, turned)
    position = motor.actual_position
    equal("ROL is the other way", module.connection.send(TMCLCommand.ROL, 0, 0, SPEED).value, SPEED)
    wait_for("speed of ROL", lambda: motor.actual_velocity == -SPEED)
    check("position counts down", motor.actual_position < position, motor.actual_position)
    motor.stop()
    wait_for("stop of ROL", lambda: motor.actual_velocity == 0)


def positioning(module, simulator):
    motor = module.motors[0]
    motor.actual_position = 0
    equal("position is set", motor.actual_position, 0)
    rotor = simulator.control("state")["rotor"]
    for what, move, target in (
        ("move to", lambda: motor.move_to(20_000, 1500), 20_000),
        ("move by", lambda: motor.move_by(-30_000), -10_000),
        ("move back", lambda: motor.move_to(0), 0),
    ):
        move()
        equal(f"{what}: target", motor.target_position, target)
        check(f"{what}: not there at once", motor.get_position_reached() == 0)
        wait_for(f"{what}: reached", lambda: motor.get_position_reached() == 1)
        equal(f"{what}: position", motor.actual_position, target)
    equal("speed of move to", motor.linear_ramp.max_velocity, 1500)
    equal("the rotor is back", simulator.control("state")["rotor"], rotor)


def stall(module, simulator):
    motor = module.motors[0]
    guard = motor.stallguard2
    guard.threshold = 0
    motor.rotate(SPEED)
    wait_for("rotating", lambda: motor.actual_velocity == SPEED)
    # As PyTrinamic's own calibration does, without asking a person to press Enter.
    load = 0
    for threshold in range(64):
        guard.threshold = threshold
        simulator.let_pass(0.2)
        load = guard.load_value
        if load > 0:
            break
    check("load value leaves zero", load > 0, load)
    print(f"    stallGuard2: threshold {guard.threshold}, load value {load}")
    guard.stop_velocity = SPEED // 2
    equal("stop on stall is armed", guard.stop_velocity, SPEED // 2)
    equal("no stall without a load", motor.actual_velocity, SPEED)
    simulator.control("load 1")
    wait_for("the stall stops the motor", lambda: motor.actual_velocity == 0)
    flags = motor.AP.ExtendedErrorFlags
    equal("stall error flag", motor.get_axis_parameter(flags), 1)
    equal("reading has cleared it", motor.get_axis_parameter(flags), 0)
    simulator.control("load 0")
    guard.stop_velocity = 0


def session(name, arguments, simulator):
    """All checks over one interface, with a module that has just been switched on."""
    print(f"{name}:", flush=True)
    simulator.control("power off")
    simulator.control("power on")
    simulator.let_pass(START)
    manager = ConnectionManager(f"--interface {name} {arguments} --timeout {PATIENCE}")
    with manager.connect() as connection:
        module = TMCM1140(connection)
        versions(connection)
        parameters(module)
        settings(module.motors[0])
        inputs_and_outputs(module, simulator)
        rotation(module, simulator)
        positioning(module, simulator)
        stall(module, simulator)


def tour(serial, simulator):
    """The program of the tour, which has a port of its own, moves the motor to where it says."""
    print("docs/tour.md:", flush=True)
    [program] = re.findall(r"^```python\n(.*?)^```$", TOUR.read_text(), re.DOTALL | re.MULTILINE)
    check("the port is named", "/tmp/tmcm1140" in program, program)
    simulator.control("power off")
    simulator.control("power on")
    simulator.let_pass(START)
    rotor = simulator.control("state")["rotor"]
    exec(program.replace("/tmp/tmcm1140", serial), {})
    # 51 200 microsteps of 256 in a full step, which are the units of the rotor.
    equal("the rotor has turned", simulator.control("state")["rotor"] - rotor, 51_200)


def main():
    options = command_line("Drives the virtual module with PyTrinamic.")
    with tempfile.TemporaryDirectory() as folder:
        serial, rs485, slcan = (str(Path(folder) / name) for name in ("tmcm1140", "rs485", "slcan"))
        links = ("--serial", serial, "--rs485", rs485, "--slcan", slcan, "--tcp", "127.0.0.1:0")
        simulator = Simulator(options.binary, *links, image=options.image)
        sessions = [
            ("usb_tmcl", f"--port {serial}"),
            ("serial_tmcl", f"--port {rs485} --data-rate 9600"),
            ("slcan_tmcl", f"--port {slcan}"),
        ]
        if not options.image:
            # The same USB link by other names.
            sessions += [
                ("serial_tmcl", f"--port {serial} --data-rate 9600"),
                ("socket_serial_tmcl", f"--port {simulator.told['tcp']}"),
            ]
        try:
            for name, arguments in sessions:
                try:
                    session(name, arguments, simulator)
                except Exception as error:  # One interface that fails shall not hide the others.
                    check(name, False, repr(error))
            tour(serial, simulator)
        finally:
            simulator.end()
        check("the serial port's link is gone", not Path(serial).is_symlink())
    conclude()


if __name__ == "__main__":
    main()
