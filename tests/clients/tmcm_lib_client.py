#!/usr/bin/env python3
"""Drives a virtual TMCM-3110 with TMCM-Lib, unmodified, which was written for that module: its motors one by one, and as a
union that moves at once or on a straight line.

    python3 tests/clients/tmcm_lib_client.py target/debug/tmcl

Starts `tmcl sim` itself. Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

from tmcm_lib import Module, MotorUnion, Port
from virtual_module import check, drive, equal, wait_for

MOTORS = 3
WORLD = "".join(f"[[axis]]\n[axis.stage]\nhome = [{2000 + 800 * n}, {2400 + 800 * n}]\n" for n in range(MOTORS))


def rotors(simulator):
    return [axis["rotor"] for axis in simulator.control("state")["axes"]]


def module_settings(module, simulator):
    equal("model", module.model_number, 3110)
    equal("firmware", module.firmware_version, (1, 14))
    equal("motors", (module.motor_count, module.coordinate_count), (MOTORS, 20))
    check("supply", abs(module.supply_voltage - 24_000) <= 100, module.supply_voltage)
    for on in (True, False):
        module.switch_limit_pullup_enabled = on
        wait_for("pull-ups", lambda: simulator.control("state")["pull_up_groups"] == [on])
    for level in (False, True):
        module.switch_limit_activity = level
    module.heartbeat_timeout = 1000
    simulator.let_pass(2)
    equal("the heartbeat of the library is heard", module.heartbeat_timeout, 1000)
    module.heartbeat_timeout = 0
    # Writing a coordinate of the whole module is a bug of the library: one motor after the other can be written.
    position = (1, -20, 300_000)
    for motor, place in zip(module.motors, position):
        motor.coordinates[7] = place
    equal("coordinate", module.coordinates[7], position)


def motors_alone(module, simulator):
    for number, motor in enumerate(module.motors):
        motor.microstep_resolution = 256
        motor.current_moving, motor.current_standby = 1000, 200
        motor.velocity_moving = 100.0
        check(f"speed of {number}", 99 < motor.velocity_moving <= 100, motor.velocity_moving)
        motor.acceleration_moving = 500.0
        check(f"acceleration of {number}", 480 < motor.acceleration_moving <= 500, motor.acceleration_moving)
        before = rotors(simulator)
        motor.move_to(20_000 + number)
        equal(f"position of {number}", motor.position, 20_000 + number)
        motor.move_by(-30_000)
        equal(f"position of {number} after a distance", motor.position, -10_000 + number)
        motor.move_to(0)
        equal(f"rotors after {number}", rotors(simulator), before)
        check(f"switches of {number}", not (motor.switch_limit_left.active or motor.switch_limit_right.active))
        simulator.control(f"press left {number}")
        wait_for(f"left switch of {number}", lambda: motor.switch_limit_left.active)
        simulator.control(f"release left {number}")


def union(module, simulator):
    """All motors at once: with 0x40 in the motor byte of MVP COORD on a straight line, with 0x80 each at its own speed."""
    motors = MotorUnion(module, range(MOTORS))
    for target, line in (((40_000, -20_000, 8_000), True), ((-5_000, 30_000, 100), True), ((0, 0, 0), False)):
        start = rotors(simulator)
        before = motors.position
        motors.move_to(target, wait_while_moving=False, synchronously=line)
        seen = []
        while motors.moving:
            seen.append(rotors(simulator))
        equal("position of the union", motors.position, target)
        turned = [now - then for now, then in zip(rotors(simulator), start)]
        distances = [to - come for to, come in zip(target, before)]
        equal("rotors of the union", turned, distances)
        if line:
            longest = max(map(abs, distances))
            leader = [abs(distance) for distance in distances].index(longest)
            check("some places on the way", len(seen) > 10, len(seen))
            for place in seen:
                ahead = (place[leader] - start[leader]) / distances[leader]
                off = [abs(now - then - ahead * way) for now, then, way in zip(place, start, distances)]
                check("a straight line", max(off) <= 0.005 * longest, (place, off))


def session(simulator):
    module = Module.construct(Port(simulator.told["serial"]))
    module_settings(module, simulator)
    motors_alone(module, simulator)
    union(module, simulator)


if __name__ == "__main__":
    drive("Drives a virtual TMCM-3110 with TMCM-Lib.", {"3110": (session, WORLD)}, "--serial", "{folder}/usb")
