#!/usr/bin/env python3
"""Runs the vendor's demos for this module, the scripts of PyTrinamic's own package, unmodified, as a person does.

    python3 tests/clients/vendor_demos.py target/debug/tmcl
    python3 tests/clients/vendor_demos.py target/debug/tmcl --image target/thumbv7em-none-eabi/release/tmcm1140

With --image each module is the flash image on the emulated microcontroller. Each demo has a `tmcl sim` of its own; they
run at the same time, because they sleep for most of it. At their prompts somebody puts a load on the motor or takes it
off, and presses Enter. Their telegrams pass through here: one of them is held back for as long as there is something to
be looked at, so that no check depends on how fast the computer is.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import collections
import importlib.metadata
import os
import select
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

from virtual_module import PATIENCE, Simulator, check, command_line, conclude, equal

SCRIPTS = "examples/modules/TMCM1140/TMCL/"
TELEGRAM = 9
ROR, MST, MVP, SAP, GAP = 1, 3, 4, 5, 6
ABSOLUTE, RELATIVE = 0, 1
# Axis parameters.
TARGET_POSITION, ACTUAL_POSITION, ACTUAL_VELOCITY = 0, 1, 3
MAX_VELOCITY, MAX_ACCELERATION, MAX_CURRENT, STANDBY_CURRENT = 4, 5, 6, 7
REACHED, RESOLUTION, HYSTERESIS, HYSTERESIS_START, THRESHOLD, ACTUAL_CURRENT = 8, 140, 170, 172, 174, 180
STOP_ON_STALL, THRESHOLD_SPEED, BOOST, LOAD_VALUE, ERRORS = 181, 182, 200, 206, 207

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
# What is read at which threshold depends on the motor; for that of the simulator see hal-sim/src/chip/tmc262/load.rs.
# 12 is the first threshold that reads more than 0 with the load where it is to stop (it reads 38; 6 would do without a
# load); 13 is the first that reads 450 or more without a load (512; 256 with the load of coolStep).
STOPPING_THRESHOLD = 12
MIDDLE_THRESHOLD = 13
LOADED, FREE = 4, 8  # 15 x 256 / 1023 and 15 x 512 / 1023, rounded.
# 1/256 full steps in a turn of the motor.
TURN = 51_200

Command = collections.namedtuple("Command", "opcode kind value answer")


def signed(data):
    return int.from_bytes(data, "big", signed=True)


def script(name):
    """Where the package has put a demo."""
    for file in importlib.metadata.files("pytrinamic"):
        if file.as_posix() == SCRIPTS + name:
            return str(file.locate())
    sys.exit(f"PyTrinamic has no {SCRIPTS}{name}")


class Demo:
    """A running demo and the module that it drives, which has just been switched on."""

    def __init__(self, name, options):
        path = script(name)
        self.name = name
        self.module = Simulator(options.binary, "--tcp", "127.0.0.1:0", image=options.image)
        self.link = self.module.connect("tcp")
        self.listener = socket.create_server(("127.0.0.1", 0))
        port = "{}:{}".format(*self.listener.getsockname())
        arguments = ("--interface", "socket_serial_tmcl", "--port", port, "--timeout", str(PATIENCE))
        command = [sys.executable, "-u", path, *arguments]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
        self.host = None
        self.sources = {self.listener: self.accept, self.process.stdout: self.read}
        # What it has printed and nobody has looked at yet.
        self.printed = b""
        # The telegram that it is sending or that is held back, and the commands that it has had replies to.
        self.telegram = b""
        self.commands = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait(PATIENCE)
        for stream in (self.process.stdin, self.process.stdout, self.listener, self.link):
            stream.close()
        if self.host:
            self.host.close()
        self.module.end()

    def accept(self):
        self.host, _ = self.listener.accept()
        self.sources[self.host] = self.receive

    def read(self):
        data = self.process.stdout.read(4096)
        self.printed += data
        if not data:
            del self.sources[self.process.stdout]

    def receive(self):
        data = self.host.recv(TELEGRAM - len(self.telegram))
        self.telegram += data
        if not data:
            del self.sources[self.host]

    def pass_on(self):
        """Lets the module have the telegram, and the demo its reply. A load value that it asks for has been measured
        since its last command: the demos wait so long for that, but a slow computer's emulated module does not."""
        telegram, self.telegram = self.telegram, b""
        if telegram[1:3] == bytes([GAP, LOAD_VALUE]):
            self.module.let_pass(0.05)
        reply = self.exchange(telegram)
        self.commands.append(Command(telegram[1], telegram[2], signed(telegram[4:8]), signed(reply[4:8])))
        self.host.sendall(reply)

    def exchange(self, telegram):
        self.link.sendall(telegram)
        reply = b""
        while len(reply) < TELEGRAM:
            data = self.link.recv(TELEGRAM - len(reply))
            if not data:
                raise ConnectionError("the module has gone")
            reply += data
        return reply

    def until(self, what, condition):
        """Lets the demo go on until there is what the condition gives, and gives that."""
        end = time.monotonic() + PATIENCE
        if len(self.telegram) == TELEGRAM:
            self.pass_on()
        while (found := condition()) is None:
            if len(self.telegram) == TELEGRAM:
                self.pass_on()
            elif self.process.stdout not in self.sources:
                raise EOFError(f"has ended before {what}")
            ready, _, _ = select.select([*self.sources], [], [], max(0.0, end - time.monotonic()))
            if not ready:
                raise TimeoutError(f"{what}: not within {PATIENCE} s")
            for source in ready:
                self.sources[source]()
        return found

    def until_command(self, opcode, kind):
        """Holds a telegram back when it comes; gives its value."""

        def condition():
            if len(self.telegram) == TELEGRAM and tuple(self.telegram[1:3]) == (opcode, kind):
                return signed(self.telegram[4:8])
            return None

        return self.until(f"command {opcode}, type {kind}", condition)

    def until_printed(self, text):
        def condition():
            _, found, rest = self.printed.partition(text.encode())
            if not found:
                return None
            self.printed = rest
            return True

        self.until(f"the words: {text}", condition)

    def until_asked(self, request):
        """Waits for a request to a person, who is to press Enter when it is done."""
        self.until_printed(request)
        self.until_printed("Press enter to continue")

    def enter(self):
        """Presses Enter; before that what has been done to the motor has had its effect, for people are slow."""
        self.module.let_pass(0.2)
        self.process.stdin.write(b"\n")

    def until_end(self):
        self.until("its end", lambda: None if self.process.stdout in self.sources else True)
        self.equal("exit code", self.process.wait(PATIENCE), 0)
        self.check("the last line", self.printed.endswith(b"Ready.\n"), self.printed)

    def ask(self, parameter):
        """Value of an axis parameter; the demo does not know that somebody else asks."""
        telegram = bytes([1, GAP, parameter, 0, 0, 0, 0, 0])
        return signed(self.exchange(telegram + bytes([sum(telegram) & 0xFF]))[4:8])

    def written(self, parameter):
        """What it has written to an axis parameter."""
        return [command.value for command in self.commands if command[:2] == (SAP, parameter)]

    def answers(self, parameter):
        """What it has read from an axis parameter."""
        return [command.answer for command in self.commands if command[:2] == (GAP, parameter)]

    def state(self):
        return self.module.control("state")

    def load(self, load):
        self.module.control(f"load {load}")

    def check(self, what, good, found=""):
        check(f"{self.name}: {what}", good, found)

    def equal(self, what, found, expected):
        equal(f"{self.name}: {what}", found, expected)

    def wait_for(self, what, condition):
        """Checks that the condition holds before five seconds of the module's time have passed."""
        end = self.state()["time_us"] + 5_000_000
        while not (held := condition()) and self.state()["time_us"] < end:
            time.sleep(0.01)
        self.check(what, held, self.state())


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


def run(name, course, options):
    with Demo(name, options) as demo:
        try:
            course(demo)
        except Exception as error:  # One demo that fails shall not hide the others.
            demo.check("to its end", False, repr(error))


def main():
    options = command_line("Runs the vendor's demos for this module on virtual modules.")
    demos = {"rotate_demo.py": rotate, "StallGuard2_demo.py": stall_guard, "CoolStep_demo.py": cool_step}
    with ThreadPoolExecutor() as pool:
        runs = [pool.submit(run, name, course, options) for name, course in demos.items()]
    for running in runs:
        running.result()
    conclude()


if __name__ == "__main__":
    main()
