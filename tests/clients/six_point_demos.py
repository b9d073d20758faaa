"""The courses of the vendor's demos for modules whose ramp generator is in the driver: ramps of six points, and a stall."""

from demo import ABSOLUTE, ACTUAL_POSITION, ACTUAL_VELOCITY, ERRORS, GAP, LOAD_VALUE, MAX_ACCELERATION, MAX_CURRENT
from demo import MAX_VELOCITY, MVP, RESOLUTION, ROR, STANDBY_CURRENT, STOP_ON_STALL, THRESHOLD

# Axis parameters of the ramp.
A1, V1, MAX_DECELERATION, D1, START_VELOCITY, STOP_VELOCITY, WAIT_TIME = range(15, 22)


def settings(demo, values):
    """The parameters that it has written, and that the module has them."""
    for parameter, value in values.items():
        demo.equal(f"parameter {parameter}", demo.written(parameter), [value])
        demo.equal(f"parameter {parameter} of the module", demo.ask(parameter), value)


# The ramp of the demo: what it sets, and the way.
RAMP = {
    MAX_VELOCITY: 40_000,
    MAX_ACCELERATION: 30_000,
    A1: 5_000,
    V1: 10_000,
    MAX_DECELERATION: 20_000,
    D1: 5_000,
    START_VELOCITY: 5_000,
    STOP_VELOCITY: 5_000,
    WAIT_TIME: 31_250,
}
WAY = 100_000


def ramp_speed(way):
    """The speed so far from the start: v^2 = v0^2 + 2as on each part of the ramp, from the start up and from the end back."""
    square = RAMP[MAX_VELOCITY] ** 2
    for distance, first, slow, fast in (
        (way, START_VELOCITY, A1, MAX_ACCELERATION),
        (WAY - way, STOP_VELOCITY, D1, MAX_DECELERATION),
    ):
        knee = (RAMP[V1] ** 2 - RAMP[first] ** 2) / (2 * RAMP[slow])
        if distance < knee:
            square = min(square, RAMP[first] ** 2 + 2 * RAMP[slow] * distance)
        else:
            square = min(square, RAMP[V1] ** 2 + 2 * RAMP[fast] * (distance - knee))
    return square**0.5


def follows(demo, start, sign):
    """Each speed that it has read is one of the ramp between the positions read before and after it."""
    seen = [command for command in demo.commands if command[:2] in ((GAP, ACTUAL_POSITION), (GAP, ACTUAL_VELOCITY))]
    ways = [sign * (command.answer - start) for command in seen[::2]]
    speeds = [sign * command.answer for command in seen[1::2]]
    demo.check("it looks often", len(speeds) > 50, len(speeds))
    demo.equal("the highest speed", max(speeds), RAMP[MAX_VELOCITY])
    for before, speed, after in zip(ways, speeds, ways[1:]):
        # At rest, before the motor starts and when it has arrived, the speed is 0.
        bounds = [ramp_speed(way) for way in range(before, after, max(1, (after - before) // 20))]
        bounds += [ramp_speed(after)] + [0] * (before in (0, WAY) or after in (0, WAY))
        within = 0.995 * min(bounds) - 100 <= speed <= 1.005 * max(bounds) + 100
        demo.check("a speed of the ramp", within, (before, speed, after))


def six_point_ramp(demo):
    demo.equal("the first target", demo.until_command(MVP, ABSOLUTE), WAY)
    settings(demo, {**RAMP, ACTUAL_POSITION: 0})
    start = demo.state()["rotor"]
    demo.commands.clear()
    demo.equal("the second target", demo.until_command(MVP, ABSOLUTE), 0)
    follows(demo, 0, 1)
    demo.equal("the way there", (demo.ask(ACTUAL_POSITION), demo.state()["rotor"] - start), (WAY, WAY))
    demo.commands.clear()
    demo.until_end("")
    follows(demo, WAY, -1)
    demo.equal("the way back", (demo.ask(ACTUAL_POSITION), demo.state()["rotor"]), (0, start))


# Half of the torque that the motor has at a maximum current of 128: 17/32 of the full current.
HALF_TORQUE = 17 / 32 / 2


def six_point_stall(demo):
    demo.equal("speed", demo.until_command(ROR, 0), 10_000)
    settings(demo, {MAX_CURRENT: 128, STANDBY_CURRENT: 8, RESOLUTION: 8, ACTUAL_POSITION: 0, STOP_ON_STALL: 0})
    demo.commands.clear()
    demo.until_printed("Apply load and try to stall the motor...")
    thresholds = demo.written(THRESHOLD)
    demo.equal("thresholds, one after the other", thresholds, list(range(len(thresholds))))
    demo.check("a load value above 0", 0 < demo.answers(LOAD_VALUE)[-1], demo.answers(LOAD_VALUE)[-1])
    demo.equal("stop on stall", (demo.written(STOP_ON_STALL), demo.ask(STOP_ON_STALL)), ([9_999], 9_999))
    demo.equal("it turns", demo.ask(ACTUAL_VELOCITY), 10_000)
    demo.load(HALF_TORQUE)
    demo.until_printed("Motor stopped by StallGuard2!")
    demo.equal("stopped by stallGuard2", (demo.ask(ACTUAL_VELOCITY), demo.ask(ERRORS)), (0, 1))
    demo.equal("stopped before it lost a step", demo.state()["lost_steps"], 0)
    demo.until_end("")
