#!/usr/bin/env python3
"""Equal runs end equally: Trinamic's own PyTrinamic, unmodified, homes, moves, stalls and loses the power of a paused module,
with random sleeps in the host and beside a busy core. All numbers and all telegrams are the same in each run.

    python3 tests/clients/paused_client.py target/debug/tmcl
    python3 tests/clients/paused_client.py target/debug/tmcl --image target/thumbv7em-none-eabi/release/tmcm1140

With --image the module is the flash image on the emulated microcontroller. Starts `tmcl sim` itself.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import hashlib
import multiprocessing
import random
import tempfile
import time
from pathlib import Path

from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM1140
from virtual_module import Simulator, check, command_line, conclude, equal

# How often the whole is done on the core, and on the flash image, whose runs take longer.
RUNS, RUNS_OF_AN_IMAGE = 10, 3
# The longest of the host's sleeps, in seconds.
LONGEST_SLEEP = 0.02
# What passes for the module with each reply: a poll of the host.
POLL = "5 ms"
# More polls than any of the waits takes.
POLLS = 2000
WORLD = "[stage]\nleft = -20000\nright = 400000\n"
# Types of the command RFS.
START, STATUS = 0, 2


def sleep():
    time.sleep(random.uniform(0, LONGEST_SLEEP))


def polls_until(what, condition):
    """Polls the module until the condition holds; how often that was is one of the numbers of a run."""
    for count in range(POLLS):
        if condition():
            return count
        sleep()
    check(what, False, f"not after {POLLS} polls")
    return POLLS


def homed(connection):
    connection.reference_search(START, 0)
    return polls_until("the search ends", lambda: connection.reference_search(STATUS, 0) == 0)


def moved(motor):
    motor.set_axis_parameter(motor.AP.MaxVelocity, 1000)
    motor.set_axis_parameter(motor.AP.MaxAcceleration, 500)
    motor.move_to(100_000)
    return polls_until("the motor arrives", motor.get_position_reached), motor.actual_position


def stalled(motor, simulator):
    """The load that stops the motor comes at a time between two polls."""
    motor.stallguard2.set_filter(0)
    motor.stallguard2.set_threshold(2)
    motor.stallguard2.set_stop_velocity(500)
    motor.rotate(800)
    simulator.control("at 1.2345 s load 1")
    polls = polls_until("the motor stalls", lambda: motor.get_actual_velocity() == 0 and motor.actual_position > 100_000)
    simulator.control("load 0")
    return polls, motor.actual_position


def cut(motor, simulator):
    """The power goes in the middle of a move."""
    motor.move_to(0)
    simulator.control("at 123.456 ms power off")
    simulator.control("step 1 s")
    lost = simulator.control("state")
    simulator.control("power on")
    simulator.control("step 200 ms")
    return lost["rotor"], motor.actual_position


def run(options, folder):
    """The numbers of one run, and the digest of all its telegrams."""
    world, log = folder / "world.toml", folder / "telegrams.txt"
    world.write_text(WORLD)
    arguments = ("--paused", "--tcp", "127.0.0.1:0", "--world", str(world), "--log-telegrams", str(log))
    simulator = Simulator(options.binary, *arguments, image=options.image)
    numbers = []
    try:
        simulator.control(f"pause {POLL}")
        with ConnectionManager(f"--interface socket_serial_tmcl --port {simulator.told['tcp']}").connect() as connection:
            motor = TMCM1140(connection).motors[0]
            numbers.append(("homed", homed(connection)))
            numbers.append(("moved", moved(motor)))
            numbers.append(("stalled", stalled(motor, simulator)))
            numbers.append(("cut", cut(motor, simulator)))
        state = simulator.control("state")
        numbers += [(name, state[name]) for name in ("time_us", "position", "rotor", "lost_steps", "time")]
    finally:
        simulator.end()
    return numbers, hashlib.sha256(log.read_bytes()).hexdigest()


def be_busy():
    while True:
        pass


def main():
    options = command_line(__doc__)
    busy = multiprocessing.Process(target=be_busy, daemon=True)
    busy.start()
    first = None
    for number in range(RUNS_OF_AN_IMAGE if options.image else RUNS):
        random.seed(number)
        with tempfile.TemporaryDirectory() as folder:
            numbers, digest = run(options, Path(folder))
        if first is None:
            first = numbers, digest
            print(f"    {numbers}\n    {digest}")
            found = dict(numbers)
            check("the motor has moved", found["moved"][1] == 100_000, found)
            check("the stall has stopped the motor", 100_000 < found["stalled"][1] < 400_000, found)
            check("the rotor stands where the power went", 0 < found["cut"][0], found)
            equal("position after the power came back", found["cut"][1], 0)
            equal("time", found["time"], "paused")
        else:
            equal(f"numbers of run {number + 1}", numbers, first[0])
            equal(f"digest of run {number + 1}", digest, first[1])
    busy.kill()
    conclude()


if __name__ == "__main__":
    main()
