"""A script of PyTrinamic's own package that runs as a person runs it, and the module that it drives."""

import collections
import importlib.metadata
import os
import select
import socket
import subprocess
import sys
import time

from virtual_module import PATIENCE, Simulator, check, equal

SCRIPTS = "examples/modules/{}/TMCL/{}"
TELEGRAM = 9
ROR, MST, MVP, SAP, GAP = 1, 3, 4, 5, 6
ABSOLUTE, RELATIVE = 0, 1
# Axis parameters.
TARGET_POSITION, ACTUAL_POSITION, ACTUAL_VELOCITY = 0, 1, 3
MAX_VELOCITY, MAX_ACCELERATION, MAX_CURRENT, STANDBY_CURRENT = 4, 5, 6, 7
REACHED, RESOLUTION, HYSTERESIS, HYSTERESIS_START, THRESHOLD, ACTUAL_CURRENT = 8, 140, 170, 172, 174, 180
STOP_ON_STALL, THRESHOLD_SPEED, BOOST, LOAD_VALUE, ERRORS = 181, 182, 200, 206, 207

Command = collections.namedtuple("Command", "opcode kind value answer")


def signed(data):
    return int.from_bytes(data, "big", signed=True)


def script(module, name):
    """Where the package has put a demo for a module."""
    path = SCRIPTS.format(module, name)
    for file in importlib.metadata.files("pytrinamic"):
        if file.as_posix() == path:
            return str(file.locate())
    sys.exit(f"PyTrinamic has no {path}")


class Demo:
    """A running demo and the module that it drives, which has just been switched on."""

    def __init__(self, product, path, options):
        self.name = f"{product}, {os.path.basename(path)}"
        self.module = Simulator(options.binary, "--product", product, "--tcp", "127.0.0.1:0", image=options.image)
        self.link = self.module.connect("tcp")
        self.listener = socket.create_server(("127.0.0.1", 0))
        port = "{}:{}".format(*self.listener.getsockname())
        arguments = ("--interface", "socket_serial_tmcl", "--port", port, "--timeout", str(PATIENCE))
        command = [sys.executable, "-u", path, *arguments]
        # Plots are drawn where nobody sees them.
        environment = {**os.environ, "MPLBACKEND": "Agg"}
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, bufsize=0, env=environment)
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
        since its last command that was another one: the demos wait so long for that, but a slow computer's emulated module
        does not."""
        telegram, self.telegram = self.telegram, b""
        asked = (GAP, LOAD_VALUE)
        if tuple(telegram[1:3]) == asked and not (self.commands and self.commands[-1][:2] == asked):
            self.module.let_pass(0.1)
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

    def until_end(self, last="Ready.\n"):
        self.until("its end", lambda: None if self.process.stdout in self.sources else True)
        self.equal("exit code", self.process.wait(PATIENCE), 0)
        self.check("the last line", self.printed.endswith(last.encode()), self.printed)

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
