#!/usr/bin/env python3
"""Drives a virtual TMCM-1110 and a TMCM-6110 with pylablib, unmodified: its class for the one, and that for the modules with
several axes.

    python3 tests/clients/pylablib_client.py target/debug/tmcl
    python3 tests/clients/pylablib_client.py target/debug/tmcl --product 6110 \
        --image target/thumbv7em-none-eabi/release/tmcm6110

With --image the module is the flash image on the emulated microcontroller. Starts `tmcl sim` itself.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

from pylablib.devices import Trinamic
from virtual_module import PATIENCE, check, drive, equal, wait_for

AXES = 6
# Microsteps from the zero of each motor to its left end switch.
LEFT = -4000
WORLD = "".join(f"[[axis]]\n[axis.stage]\nleft = {LEFT - 500 * axis}\nhard_left = -60000\n" for axis in range(AXES))


def information(stage):
    """Everything that pylablib reads of a stage, and of each axis."""
    equal("axes", stage.get_all_axes(), list(range(AXES)))
    # The level "all" reads what is read seldom, too.
    for name, value in stage.get_full_info(include="all").items():
        if isinstance(value, dict) and name != "conn":
            equal(f"{name} of all axes", sorted(value), list(range(AXES)))
    for axis in range(AXES):
        equal(f"speed of {axis}", stage.get_velocity_parameters(axis=axis)[:2], (1000, 1000))
        equal(f"switches of {axis}", stage.get_limit_switches_parameters(axis=axis), (False, False))
        equal(f"homing of {axis}", stage.get_home_parameters(axis=axis), ("lim_left", 500, 100))
        equal(f"last home of {axis}", stage.get_last_home_position(axis=axis), 0)
        check(f"axis {axis} does not home", not stage.is_homing(axis=axis))
        stage.setup_current(drive_current=0.25, axis=axis)
        equal(f"step of {axis}", stage.get_microstep_resolution(axis=axis), 256)


def polarity(stage, simulator):
    """The polarity of the end switches is that of three axes."""
    for chosen, others in ((1, 4), (4, 1)):
        stage.set_switch_polarity(True, axis=chosen)
        equal("polarities", [stage.get_switch_polarity(axis=axis) for axis in (chosen, others)], [True, False])
        wait_for("the other half", lambda: stage.get_limit_switches_state(axis=others) == (False, False))
        wait_for("open switches are closed", lambda: stage.get_limit_switches_state(axis=chosen) == (True, True))
        stage.set_switch_polarity(False, axis=chosen)
        equal("polarity", stage.get_switch_polarity(axis=chosen), False)
        simulator.control(f"press right {chosen}")
        wait_for("one switch", lambda: stage.get_limit_switches_state(axis=chosen) == (False, True))
        equal("its neighbour", stage.get_limit_switches_state(axis=chosen + 1), (False, False))
        simulator.control(f"release right {chosen}")


def homing(stage, simulator):
    for axis in range(AXES):
        stage.setup_home("lim_left", search_speed=600, switch_speed=150, axis=axis)
        stage.home(timeout=PATIENCE, axis=axis)
        equal(f"axis {axis} is at zero", stage.get_position(axis=axis), 0)
        off = simulator.control("state")["axes"][axis]["rotor"] - LEFT + 500 * axis
        check(f"axis {axis} is at its left switch", abs(off) < 300, off)


def motion(stage):
    for axis in range(AXES):
        stage.setup_velocity(speed=800 + 50 * axis, axis=axis)
        stage.move_to(3000 + 700 * axis, axis=axis)
    for axis in range(AXES):
        stage.wait_move(axis=axis)
        equal(f"position of {axis}", stage.get_position(axis=axis), 3000 + 700 * axis)
        stage.set_position_reference(10 * axis, axis=axis)
        equal(f"new position of {axis}", stage.get_position(axis=axis), 10 * axis)
        stage.jog("+", axis=axis)
        wait_for(f"axis {axis} turns", lambda: stage.is_moving(axis=axis) and stage.get_current_speed(axis=axis) != 0)
        stage.stop(axis=axis)
        wait_for(f"axis {axis} stops", lambda: not stage.is_moving(axis=axis))
    for port in (0, 4):
        equal(f"analog input {port}", stage.get_general_input(port, bank=1).value, 0)


def session(simulator):
    stage = Trinamic.TMCMx110((simulator.told["serial"], 9600))
    information(stage)
    polarity(stage, simulator)
    homing(stage, simulator)
    motion(stage)
    stage.close()


def one_axis(simulator):
    """All that the class for the TMCM-1110 has, on its one axis."""
    stage = Trinamic.TMCM1110((simulator.told["serial"], 9600))
    information = stage.get_full_info(include="all")
    for name, expected in (
        ("position", 0),
        ("velocity_parameters", (1000, 1000, 8, 128)),
        ("limit_switches_parameters", (False, False)),
        ("home_parameters", ("lim_left", 500, 100)),
        ("limit_switches_state", (False, False)),
        ("microstep_resolution", 256),
        ("moving", False),
        ("homing", False),
        ("last_home_position", 0),
    ):
        equal(name, information[name], expected)
    equal("currents", stage.setup_current(0.5, 0.1), (127 / 255, 25 / 255))

    stage.set_switch_polarity(True)
    equal("polarity", stage.get_switch_polarity(), True)
    wait_for("open switches are closed", lambda: stage.get_limit_switches_state() == (True, True))
    stage.set_switch_polarity(False)
    simulator.control("press right")
    wait_for("one switch", lambda: stage.get_limit_switches_state() == (False, True))
    simulator.control("release right")

    for mode in ("lim_right", "lim_left_right", "lim_left_right_bothsides", "lim_right_bothsides", "home_neg_inv"):
        equal("mode", stage.setup_home(mode)[0], mode)
    stage.setup_home("lim_left", search_speed=600, switch_speed=150)
    stage.home(timeout=PATIENCE)
    equal("the axis is at zero", stage.get_position(), 0)
    check("the last position is that before", stage.get_last_home_position() < 0, stage.get_last_home_position())
    off = simulator.control("state")["axes"][0]["rotor"] - LEFT
    check("the axis is at its left switch", abs(off) < 300, off)

    stage.setup_velocity(speed=800, accel=900, pulse_divisor=4, ramp_divisor=64)
    stage.move_to(3000)
    stage.wait_move()
    stage.move_by(-1000)
    stage.wait_move()
    equal("position", stage.get_position(), 2000)
    equal("new position", stage.set_position_reference(10), 10)
    stage.jog("+")
    wait_for("the axis turns", lambda: stage.is_moving() and stage.get_current_speed() == 800)
    stage.stop()
    wait_for("the axis stops", lambda: not stage.is_moving())

    # The lines of the manual that are one port each: AIN_0, +VS, +5V, and five outputs.
    simulator.control("analog 0 1234")
    wait_for("AIN_0", lambda: stage.get_general_input(0, bank=1).value == 1234)
    check("supply", abs(stage.get_general_input(1, bank=1).value - 2707) <= 10)
    equal("logic supply", stage.get_general_input(2, bank=1).value, 3102)
    for port in range(5):
        stage.set_general_output(True, port)
        wait_for(f"output {port}", lambda: simulator.control("state")["outputs"][port])
        equal(f"output {port} is read", stage.get_general_input(port, bank=2).value, 1)
    stage.store_axis_parameter(4, 777)
    stage.close()


# What is done with each product, and where its switches are.
SESSIONS = {"1110": (one_axis, f"[stage]\nleft = {LEFT}\nhard_left = -60000\n"), "6110": (session, WORLD)}

if __name__ == "__main__":
    drive("Drives a virtual TMCM-1110 and a TMCM-6110 with pylablib.", SESSIONS, "--serial", "{folder}/usb")
