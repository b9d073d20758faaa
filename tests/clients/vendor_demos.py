#!/usr/bin/env python3
"""Runs the vendor's demos for the TMCM-1140, and on a TMCM-3212 some of those for the TMCM-6214, whose ramp generator is of
the same kind: the scripts of PyTrinamic's own package, unmodified, as a person does.

    python3 tests/clients/vendor_demos.py target/debug/tmcl
    python3 tests/clients/vendor_demos.py target/debug/tmcl --product 1140 \
        --image target/thumbv7em-none-eabi/release/tmcm1140

With --image each module is the flash image on the emulated microcontroller. Each demo has a `tmcl sim` of its own; they
run at the same time, because they sleep for most of it. At their prompts somebody puts a load on the motor or takes it
off, and presses Enter. Their telegrams pass through here: one of them is held back for as long as there is something to
be looked at, so that no check depends on how fast the computer is.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

from concurrent.futures import ThreadPoolExecutor

from demo import ABSOLUTE, ACTUAL_CURRENT, ACTUAL_POSITION, ACTUAL_VELOCITY, BOOST, ERRORS, GAP, HYSTERESIS
from demo import HYSTERESIS_START, LOAD_VALUE, MAX_ACCELERATION, MAX_CURRENT, MAX_VELOCITY, MST, MVP, REACHED, RELATIVE
from demo import RESOLUTION, ROR, SAP, STANDBY_CURRENT, STOP_ON_STALL, TARGET_POSITION, THRESHOLD, THRESHOLD_SPEED
from demo import Demo, script
from six_point_demos import six_point_ramp, six_point_stall
from virtual_module import command_line, conclude

# The demos set a maximum current of 16, which is a current scale of 2: 3/32 of the full one. Loads are in parts of the
# torque at full current. coolStep goes down to half that scale.
FULL_SCALE, HALF_SCALE = 2, 1
TORQUE = (FULL_SCALE + 1) / 32
# Where the motor is to stop: short of where it would lose a step.
STOPPING = 0.8 * TORQUE
# Somebody brakes the shaft: more than that, but the motor could still turn it.
BRAKE = 0.9 * TORQUE
# Where coolStep is to raise the current.
RAISING = 0.5 * TORQUE
# More than that: nine tenths of the torque at half the scale.
WORK = 0.6 * TORQUE
# What is read at which threshold depends on the motor; for that of the simulator see hal-sim/src/chip/load.rs.
# 4 is the first threshold that reads more than 0 with the load where it is to stop (it reads some 36; -2 would do without a
# load); 5 is the first that reads 450 or more without a load (510; 254 with the load of coolStep).
STOPPING_THRESHOLD = 4
MIDDLE_THRESHOLD = 5
LOADED, FREE = 4, 7  # 15 x 254 / 1023 and 15 x 510 / 1023, rounded.
# 1/256 full steps in a turn of the motor.
TURN = 51_200


def begin(demo, speed):
    """What all demos begin with, until the motor is about to rotate."""
    demo.until_command(ROR, 0)
    for parameter, value in (
        (MAX_CURRENT, 16),
        (STANDBY_CURRENT, 8),
        (BOOST, 0),
        (RESOLUTION, 8),
        (MAX_ACCELERATION, speed),
        (MAX_VELOCITY, speed),
        (ACTUAL_POSITION, 0),
    ):
        demo.equal(f"parameter {parameter}", demo.written(parameter), [value])
        demo.equal(f"parameter {parameter} of the module", demo.ask(parameter), value)
    demo.commands.clear()


def turns(demo, what, speed):
    """The rotor comes to this speed, turns on and loses no step."""
    demo.wait_for(f"{what}: the speed", lambda: demo.state()["velocity"] == speed)
    before = demo.state()
    demo.module.let_pass(0.5)
    after = demo.state()
    demo.equal(f"{what}: speed", (before["velocity"], after["velocity"]), (speed, speed))
    demo.check(f"{what}: the rotor turns", (after["rotor"] - before["rotor"]) * speed > 0, (before, after))
    demo.equal(f"{what}: lost steps", after["lost_steps"], before["lost_steps"])


def rotate(demo):
    begin(demo, 1000)
    start = demo.state()["rotor"]
    demo.until_command(MST, 0)
    turns(demo, "rotating", 1000)
    demo.wait_for("it has turned round", lambda: demo.state()["rotor"] > start + TURN)
    # It reads the position when it has sent MST, and again for MVP.
    for _ in range(2):
        demo.until_command(GAP, ACTUAL_POSITION)
    demo.wait_for("the stop", lambda: demo.state()["velocity"] == 0)
    way = demo.until_command(MVP, RELATIVE)
    stopped = demo.state()
    demo.equal("stopped", (stopped["velocity"], stopped["position"], stopped["rotor"]), (0, way, start + way))
    demo.until_command(GAP, REACHED)
    demo.equal("target", demo.ask(TARGET_POSITION), 2 * way)
    demo.until_command(MVP, ABSOLUTE)
    there = demo.state()
    demo.equal("twice as far", (there["velocity"], there["position"], there["rotor"]), (0, 2 * way, start + 2 * way))
    demo.equal("position reached, twice as far", demo.answers(REACHED)[-1], 1)
    demo.until_command(GAP, REACHED)
    turns(demo, "back", -1000)
    demo.until_end()
    back = demo.state()
    demo.equal("back at 0", (back["velocity"], back["position"], back["rotor"]), (0, 0, start))


def stop_by_stall(demo):
    """Until stallGuard2 has stopped the motor and the demo has seen that."""
    begin(demo, 2000)
    demo.until_asked("apply some load to the motor, at which you want it to stop")
    demo.equal("stop on stall is off", demo.ask(STOP_ON_STALL), 0)
    turns(demo, "rotating", 1500)
    demo.load(STOPPING)
    demo.enter()
    demo.until_asked("Now release the load.")
    readings = demo.answers(LOAD_VALUE)
    demo.equal("thresholds", demo.written(THRESHOLD), [*range(STOPPING_THRESHOLD + 1), STOPPING_THRESHOLD])
    demo.equal("load values below the last threshold", readings[:-1], [0] * STOPPING_THRESHOLD)
    demo.check("load value at the last threshold", readings[-1] > 0, readings)
    turns(demo, "with the load where it is to stop", 1500)
    demo.load(0)
    demo.enter()
    demo.equal("stop on stall", demo.until_command(SAP, STOP_ON_STALL), 1)
    for _ in range(3):
        demo.until_command(GAP, LOAD_VALUE)
    turns(demo, "armed", 1500)
    demo.check("load value without a load", demo.ask(LOAD_VALUE) > readings[-1], demo.ask(LOAD_VALUE))
    demo.load(BRAKE)


def stopped_by_stall(demo):
    demo.equal("speed that the demo has seen last", demo.answers(ACTUAL_VELOCITY)[-1], 0)
    stopped = demo.state()
    demo.equal("stopped by stallGuard2", (stopped["velocity"], demo.ask(ERRORS)), (0, 1))
    demo.equal("stopped before it lost a step", stopped["lost_steps"], 0)


def stall_guard(demo):
    stop_by_stall(demo)
    demo.until_printed("Motor stopped by StallGuard2!")
    demo.until_end()
    stopped_by_stall(demo)


def cool_step(demo):
    stop_by_stall(demo)
    # Three seconds after it has stopped; who has braked it lets go.
    demo.equal("speed of the second time", demo.until_command(ROR, 0), 1500)
    stopped_by_stall(demo)
    demo.load(0)
    start = demo.state()["rotor"]
    demo.equal("stop on stall is off", demo.until_command(SAP, STOP_ON_STALL), 0)
    demo.equal("stop on stall is still armed", demo.ask(STOP_ON_STALL), 1)
    turns(demo, "again", 1500)
    demo.wait_for("it has turned round again", lambda: demo.state()["rotor"] > start + TURN)

    demo.until_asked("do not apply any load to the motor")
    demo.commands.clear()
    demo.enter()
    demo.until_asked("apply some load to the motor, at which you want the current to increase")
    readings = demo.answers(LOAD_VALUE)
    demo.equal("thresholds", demo.written(THRESHOLD), [*range(MIDDLE_THRESHOLD + 1), MIDDLE_THRESHOLD])
    demo.check("load values rise to 450", readings == sorted(readings) and readings[-2] < 450 <= readings[-1], readings)
    demo.load(RAISING)
    demo.enter()
    demo.until_asked("release the load")
    demo.load(0)
    demo.enter()
    demo.until_command(MST, 0)
    loaded, free = demo.answers(LOAD_VALUE)[-2:]
    demo.check("the loaded motor reads less", 0 < loaded < free, (loaded, free))
    demo.equal("hysteresis start", demo.written(HYSTERESIS_START), [LOADED])
    demo.equal("hysteresis", demo.written(HYSTERESIS), [FREE - LOADED])
    demo.equal("threshold speed", demo.written(THRESHOLD_SPEED), [0])
    for load, scale, what in (
        (0, HALF_SCALE, "without a load half the current is enough"),
        (WORK, FULL_SCALE, "a load raises the current"),
        (0, HALF_SCALE, "without it the current goes down again"),
    ):
        demo.load(load)
        # A scale of 0 is 1/32 of the full current.
        demo.wait_for(what, lambda: (demo.ask(ACTUAL_CURRENT), demo.state()["current"]) == (scale, scale + 1))
        turns(demo, what, 1500)
    demo.until_end()
    demo.wait_for("stopped at the end", lambda: demo.state()["velocity"] == 0)


# The demos for each product: the module that they are written for, and what they do.
DEMOS = {
    "1140": ("TMCM1140", {"rotate_demo.py": rotate, "StallGuard2_demo.py": stall_guard, "CoolStep_demo.py": cool_step}),
    "3212": ("TMCM6214", {"six_point_ramp_demo.py": six_point_ramp, "StallGuard2_demo.py": six_point_stall}),
}


def run(product, path, course, options):
    with Demo(product, path, options) as demo:
        try:
            course(demo)
        except Exception as error:  # One demo that fails shall not hide the others.
            demo.check("to its end", False, repr(error))


def main():
    options = command_line("Runs the vendor's demos on virtual modules.", tuple(DEMOS))
    with ThreadPoolExecutor() as pool:
        runs = []
        for product in options.products:
            module, demos = DEMOS[product]
            for name, course in demos.items():
                runs.append(pool.submit(run, product, script(module, name), course, options))
    for running in runs:
        running.result()
    conclude()


if __name__ == "__main__":
    main()
