"""What the clients have in common: a running `tmcl sim`, checks that are counted, their command line."""

import argparse
import json
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

# Longest time to wait for anything, in seconds; a busy computer is slow, and an emulated microcontroller slower.
PATIENCE = 180

passed = 0
failed = 0
counting = threading.Lock()


def check(what, good, found=""):
    """Counts a check and tells it if it fails."""
    global passed, failed
    with counting:
        if good:
            passed += 1
        else:
            failed += 1
            print(f"FAILED: {what}: {found}", flush=True)


def equal(what, found, expected):
    check(what, found == expected, f"{found!r} in place of {expected!r}")


def wait_for(what, condition):
    """Waits until the condition holds, and counts that as a check."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if condition():
            check(what, True)
            return
        time.sleep(0.01)
    check(what, False, f"not within {PATIENCE} s")


def command_line(description, products=("1140",)):
    """The program to be run, the flash image if it is to run one, and the products: all that the client is made for, or
    that of the image."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("binary", help="the program tmcl")
    parser.add_argument("--image", help="the flash image to be run, in place of the firmware's core")
    parser.add_argument("--product", choices=products, help="this product alone; with an image its product")
    options = parser.parse_args()
    if options.image and not options.product and len(products) > 1:
        parser.error("--image needs --product, the product that the image is for")
    options.products = [options.product] if options.product else list(products)
    return options


def conclude():
    """Ends the client with what it has counted."""
    print(f"{passed} passed, {failed} failed")
    sys.exit(1 if failed or not passed else 0)


class Simulator:
    """A running `tmcl sim` and its control port; `said` is what it says until it can be used, and `told` in it where it
    listens."""

    def __init__(self, binary, *arguments, image=None):
        arguments += ("--control", "127.0.0.1:0")
        if image:
            arguments += ("--image", image)
        self.process = subprocess.Popen(
            [binary, "sim", *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
        )
        self.said, self.told = [], {}
        for line in self.process.stdout:
            self.said.append(line.rstrip("\n"))
            if line.strip() == "ready":
                break
            name, _, value = line.strip().partition(": ")
            self.told.setdefault(name, value)
        else:
            sys.exit(f"{binary} did not become ready")
        self.socket = self.connect("control")
        self.lines = self.socket.makefile("rw")

    def connect(self, name):
        """A connection to one of the TCP ports it has told."""
        host, _, port = self.told[name].rpartition(":")
        return socket.create_connection((host, int(port)), timeout=PATIENCE)

    def control(self, line):
        """Carries out a line of the control protocol."""
        self.lines.write(line + "\n")
        self.lines.flush()
        answer = json.loads(self.lines.readline())
        if not answer["ok"]:
            sys.exit(f"control: {line}: {answer['error']}")
        return answer

    def let_pass(self, seconds):
        """Waits until so much of the module's time has passed: how fast it goes depends on the computer."""
        end = self.control("state")["time_us"] + 1e6 * seconds
        while self.control("state")["time_us"] < end:
            time.sleep(0.01)

    def end(self):
        """Ends it as Ctrl-C does, and checks that it goes in peace."""
        self.lines.close()
        self.socket.close()
        # Wine ends programs by other signals.
        self.process.send_signal(signal.SIGINT)
        equal("exit code of tmcl sim", self.process.wait(timeout=PATIENCE), 0)
        self.process.stdout.close()


def drive(description, sessions, *links):
    """All of a client that drives one module of each product in `sessions`: a session, and what is in the world around the
    axes. The session gets a simulator with these links, in which {folder} is a folder that is there until the end."""
    options = command_line(description, tuple(sessions))
    for product in options.products:
        session, world = sessions[product]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "world.toml"
            path.write_text(world)
            arguments = ("--product", product, "--world", str(path), *(link.format(folder=folder) for link in links))
            simulator = Simulator(options.binary, *arguments, image=options.image)
            try:
                session(simulator)
            except Exception as error:  # The simulator is to be ended, and what was counted told.
                check(f"TMCM-{product}: to the end", False, repr(error))
            finally:
                simulator.end()
    conclude()
