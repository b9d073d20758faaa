#!/usr/bin/env python3
"""Drives a virtual TMCM-3110 with TMCM-Lib, unmodified, which was written for that module: all that its classes can do, with
the motors one by one, until their switches stop them, and as a union that moves at once or on a straight line.

    python3 tests/clients/tmcm_lib_client.py target/debug/tmcl

Starts `tmcl sim` itself. Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

from tmcm_lib import Module, MotorUnion, Port
from tmcm_lib.exceptions import StateException
from virtual_module import check, drive, equal, wait_for

MOTORS = 3
# Where the limit switches of all motors close, in microsteps to the right and to the left.
END = 60_000
WORLD = "".join(
    f"[[axis]]\n[axis.stage]\nleft = {-END}\nright = {END}\nhome = [{2000 + 800 * n}, {2400 + 800 * n}]\n"
    for n in range(MOTORS)
)


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


def refused(what, error, act):
    """Whether the library refuses something."""
    try:
        act()
    except error:
        check(what, True)
    else:
        check(what, False, f"no {error.__name__}")


def until_a_switch(module, simulator):
    """move_right() and move_left() go until the limit switch stops them, if it is enabled, and return then; also where the
    switch is closed already, or is pressed by hand and opens again."""
    for number, motor in enumerate(module.motors):
        motor.velocity_moving, motor.acceleration_moving = 400.0, 2000.0
        for move, switch, end in (
            (motor.move_right, motor.switch_limit_right, END),
            (motor.move_left, motor.switch_limit_left, -END),
        ):
            what = f"{move.__name__}() of {number}"
            equal(f"{what}: the switch before", (switch.enabled, switch.active), (False, False))
            switch.enabled = True
            move()
            stood = rotors(simulator)[number]
            check(f"{what}: the place", abs(stood - end) <= 1, stood)
            equal(f"{what}: its end", (switch.active, motor.moving, motor.velocity, motor.position), (True, False, 0.0, stood))
            move()
            equal(f"{what} onto the switch", rotors(simulator)[number], stood)
        motor.move_right(False)
        simulator.let_pass(0.1)
        check(f"{number} has left its switch", motor.moving and motor.velocity > 0, motor.velocity)
        simulator.control(f"press right {number}")
        motor.wait_while_moving()
        stood = rotors(simulator)[number]
        simulator.control(f"release right {number}")
        simulator.let_pass(0.2)
        equal(f"{number} when the switch opens", (rotors(simulator)[number], motor.position), (stood, stood))
        motor.switch_limit_right.enabled = motor.switch_limit_left.enabled = False
        equal(f"switches of {number}", (motor.switch_limit_right.enabled, motor.switch_limit_left.enabled), (False, False))


def until_stop(module, simulator):
    """move_right() and move_left() go on until stop(), and what a motor that moves must not be told is refused."""
    for number, motor in enumerate(module.motors):
        for move, sign in ((motor.move_right, 1), (motor.move_left, -1)):
            before = rotors(simulator)[number]
            move(False)
            simulator.let_pass(0.1)
            for name, value in {"velocity_moving": 1.0, "acceleration_moving": 9.0, "position": 0, "microstep_resolution": 1}.items():
                refused(f"{name} of {number} while it moves", StateException, lambda: setattr(motor, name, value))
            check(f"acceleration of {number}", motor.acceleration >= 0, motor.acceleration)
            motor.stop()
            equal(f"{number} after stop()", (motor.moving, motor.velocity, motor.acceleration), (False, 0.0, 0.0))
            way = rotors(simulator)[number] - before
            check(f"{move.__name__}() of {number}", sign * way > 1000, way)


def reversed_motors(module, simulator):
    """What a motor is told when its direction has been reversed is for the other direction, and for the other switch."""
    for number, motor in enumerate(module.motors):
        # From the middle: on a busy computer the motor has gone on past its switches until stop() came.
        motor.move_to(motor.position - rotors(simulator)[number])
        motor.position = 0
        motor.coordinates[4] = 3_000
        motor.direction_reversed = True
        # The library turns the coordinate round in the module, so that it reads the same.
        equal(f"coordinate of {number}, reversed", (motor.coordinates[4], motor.direction_reversed), (3_000, True))
        before = rotors(simulator)[number]
        motor.move_to(1_000)
        equal(f"{number}, reversed", (motor.position, motor.position_target), (1_000, 1_000))
        equal(f"way of {number}, reversed", rotors(simulator)[number] - before, -1_000)
        motor.switch_limit_right.enabled = True
        motor.move_right()
        check(f"place of {number}, reversed", abs(rotors(simulator)[number] + END) <= 1, rotors(simulator)[number])
        motor.switch_limit_right.enabled = False
        motor.direction_reversed = False
        motor.move_to_coordinate(4)
        equal(f"{number} at the coordinate", (motor.position, rotors(simulator)[number] - before), (3_000, 3_000))


def settings_of_motors(module, port):
    """Whoever looks afterwards finds what was set."""
    for number, motor in enumerate(module.motors):
        motor.microstep_resolution = 16
        motor.standby_delay, motor.freewheeling_delay = 500 + 10 * number, 1_000
        for name, wrong in {"standby_delay": 0, "freewheeling_delay": 1, "microstep_resolution": 3, "velocity_moving": 1e9}.items():
            refused(f"{name} = {wrong} of {number}", ValueError, lambda: setattr(motor, name, wrong))
    names = (
        "current_moving", "current_standby", "standby_delay", "freewheeling_delay", "microstep_resolution",
        "velocity_moving", "acceleration_moving", "position",
    )
    for motor, again in zip(module.motors, Module.construct(port).motors):
        for name in names:
            equal(f"{name} of {motor.number}", getattr(again, name), getattr(motor, name))


def union_stops(module, simulator):
    motors = MotorUnion(module, range(MOTORS))
    motors.position = (0,) * MOTORS
    before = rotors(simulator)
    motors.move_to((50_000, 40_000, 30_000), wait_while_moving=False)
    simulator.let_pass(0.05)
    check("speeds of the union", all(velocity > 0 for velocity in motors.velocity), motors.velocity)
    check("accelerations of the union", all(acceleration >= 0 for acceleration in motors.acceleration), motors.acceleration)
    motors.stop()
    equal("the union after stop()", (motors.moving, motors.velocity), (False, (0.0,) * MOTORS))
    ways = tuple(now - then for now, then in zip(rotors(simulator), before))
    equal("position of the union after stop()", motors.position, ways)
    check("the union stops on its way", 0 < ways[0] < 50_000, ways)


def factory_settings(module, port, simulator, fresh):
    module.factory_settings_restore()
    simulator.let_pass(1)
    equal("model after the factory reset", Module.identify(port), (3110, (1, 14)))
    motors = Module.construct(port).motors
    equal("after the factory reset", [(motor.standby_delay, motor.microstep_resolution) for motor in motors], fresh)


def session(simulator):
    port = Port(simulator.told["serial"])
    module = Module.construct(port)
    fresh = [(motor.standby_delay, motor.microstep_resolution) for motor in module.motors]
    module_settings(module, simulator)
    motors_alone(module, simulator)
    union(module, simulator)
    until_a_switch(module, simulator)
    until_stop(module, simulator)
    reversed_motors(module, simulator)
    union_stops(module, simulator)
    settings_of_motors(module, port)
    factory_settings(module, port, simulator, fresh)


if __name__ == "__main__":
    drive("Drives a virtual TMCM-3110 with TMCM-Lib.", {"3110": (session, WORLD)}, "--serial", "{folder}/usb")
