#!/usr/bin/env python3
"""ASCII mode as a person at a terminal sees it, byte for byte.

    python3 tests/clients/ascii_terminal.py target/debug/tmcl

Starts a virtual module with a pseudo terminal and plays the transcripts in tests/clients/ascii at it, each on
a module of its own. In a transcript, `>` is typed, one character at a time, and `<` is all that the module has
sent by the time it has gone quiet; where no `<` follows, there is to be nothing. Bytes are written as in
Python's bytes literals, spaces at the end of a line as \\x20. `= 9 67 0 16` is a binary telegram - command,
type, motor, value - that is to be answered with status 100. `#` starts a comment.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import os
import pathlib
import select
import sys
import tempfile
import termios
import time
import tty

from virtual_module import Simulator, check, conclude

TRANSCRIPTS = pathlib.Path(__file__).parent / "ascii"
# The longest a reply takes, and how long the module is to be quiet before it counts as quiet.
PATIENCE = 3.0
QUIET = 0.15
BETWEEN_CHARACTERS = 0.01


class Terminal:
    """The pseudo terminal of a virtual module."""

    def __init__(self, program):
        self.directory = tempfile.TemporaryDirectory()
        path = os.path.join(self.directory.name, "module")
        self.simulator = Simulator(program, "--serial", path)
        self.fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.fd, termios.TCSANOW)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.fd)
        self.simulator.end()
        self.directory.cleanup()

    def read(self, seconds, most=4096):
        """What comes within some time; at most so many bytes."""
        end = time.monotonic() + seconds
        data = b""
        while len(data) < most:
            left = max(0.0, end - time.monotonic())
            if not select.select([self.fd], [], [], left)[0]:
                break
            data += os.read(self.fd, most - len(data))
        return data

    def type(self, text, expected):
        """Types some text and gives what comes of it: what is expected, and what comes then until it is quiet."""
        data = b""
        for character in text:
            os.write(self.fd, bytes([character]))
            data += self.read(BETWEEN_CHARACTERS)
        if len(data) < len(expected):
            data += self.read(PATIENCE, len(expected) - len(data))
        return data + self.read(QUIET)

    def telegram(self, fields):
        """Sends a command in binary mode; true if it is answered with status 100."""
        opcode, kind, motor, value = fields
        telegram = bytes([1, opcode, kind, motor]) + (value & 0xFFFFFFFF).to_bytes(4, "big")
        os.write(self.fd, telegram + bytes([sum(telegram) & 0xFF]))
        reply = self.read(PATIENCE, 9)
        return len(reply) == 9 and sum(reply[:8]) & 0xFF == reply[8] and reply[2:4] == bytes([100, opcode])


def unescape(text):
    return text.encode("ascii").decode("unicode_escape").encode("latin-1")


def escape(data):
    return repr(data)[2:-1]


def steps(path):
    """The steps of a transcript: line number, kind, text, expected answer."""
    found = []
    for number, line in enumerate(path.read_text(encoding="ascii").splitlines(), 1):
        kind, _, text = line.strip().partition(" ")
        if kind == "<" and found and found[-1][1] == ">" and not found[-1][3]:
            found[-1][3] = unescape(text)
        elif kind == ">":
            found.append([number, kind, unescape(text), b""])
        elif kind == "=":
            found.append([number, kind, [int(field) for field in text.split()], b""])
        elif kind and not kind.startswith("#"):
            raise SystemExit(f"{path}:{number}: cannot read: {line}")
    return found


def play(program, path):
    """Plays a transcript; each step is a check."""
    with Terminal(program) as terminal:
        for number, kind, text, expected in steps(path):
            if kind == "=":
                check(f"{path.name}:{number}: {text}", terminal.telegram(text), "no reply with status 100")
            else:
                received = terminal.type(text, expected)
                shown = f"received {escape(received)}\n    expected {escape(expected)}"
                check(f"{path.name}:{number}: {escape(text)}", received == expected, f"\n    {shown}")


def main():
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    for path in sorted(TRANSCRIPTS.glob("*.txt")):
        print(f"{path.name}:", flush=True)
        play(sys.argv[1], path)
    conclude()


if __name__ == "__main__":
    main()
