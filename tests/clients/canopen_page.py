#!/usr/bin/env python3
"""Does what docs/canopen.md shows, as somebody who reads it, and compares what comes out with what it says.

    python3 tests/clients/canopen_page.py target/debug/tmcl

Each section has virtual modules of its own, made by the command that it shows. A section that begins with neither a
command nor a whole program goes on where the first command and the first program of the page have a node.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import contextlib
import io
import os
import re
import shlex
import signal
import subprocess
import tempfile
from pathlib import Path

from canopen_bus import be_patient
from virtual_module import PATIENCE, Simulator, check, command_line, conclude, equal

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "canopen.md"
# Where the page has its ports, and the serial port of a module with the TMCL firmware.
HOST, SERIAL = "127.0.0.1:", "/dev/ttyACM0"
# Any number of lines.
REST = "..."


class Piece:
    """A block of a page: its language, the place of its beginning, its text, and what it prints."""

    def __init__(self, language, place, text):
        self.language, self.place, self.text, self.prints = language, place, text, ""


def sections(page):
    """The blocks of each section. What is indented is a console, or of the language `command` if it shows no prompt."""
    found, said, inside = [[]], "", None
    for number, line in enumerate(page.read_text().splitlines() + [""], 1):
        place = f"{page.name}:{number}"
        if inside and inside.language != "indented":
            if line != "```":
                inside.text += line + "\n"
                continue
            blocks = found[-1]
            if inside.language == "text" and blocks and re.match(r"prints\b", said):
                blocks[-1].prints = inside.text
            else:
                blocks.append(inside)
            inside, said = None, ""
        elif line.startswith("    "):
            inside = inside or Piece("indented", place, "")
            inside.text += line[4:] + "\n"
        else:
            if inside:
                inside.language = "console" if inside.text.startswith("$ ") else "command"
                found[-1].append(inside)
                inside, said = None, ""
            if line.startswith("```"):
                inside = Piece(line[3:], place, "")
            elif line.startswith("## "):
                found.append([])
            elif line.strip():
                said = said or line
    return [blocks for blocks in found if blocks]


def fits(shown, said):
    """Whether these lines are those that the page shows."""
    if not shown:
        return not said
    if shown[0] == REST:
        return any(fits(shown[1:], said[start:]) for start in range(len(said) + 1))
    return bool(said) and shown[0] == said[0] and fits(shown[1:], said[1:])


def told(what, shown, said):
    """Checks that this is what the page shows."""
    check(what, fits(shown.splitlines(), said.splitlines()), f"in truth it says\n{said}")


@contextlib.contextmanager
def deadline():
    """Ends what takes too long."""

    def over(*_):
        raise TimeoutError(f"not within {PATIENCE} s")

    before = signal.signal(signal.SIGALRM, over)
    signal.alarm(PATIENCE)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


class Reader:
    """Somebody who does what a section says, with a module, its ports in place of those of the page, and Python."""

    def __init__(self, binary):
        self.binary, self.simulator, self.ports, self.names = binary, None, {}, {}

    def start(self, words):
        """Starts a module, in place of the one that runs, and gives what it says."""
        self.stop()
        # The simulator has a control port by itself.
        options = [f"{HOST}0" if word.startswith(HOST) else word for word in words]
        if "--control" in options:
            at = options.index("--control")
            del options[at:at + 2]
        self.simulator = Simulator(self.binary, *options)
        for option, address in zip(words, words[1:]):
            if address.startswith(HOST):
                self.ports[address] = self.simulator.told[option.removeprefix("--")]
        said = "\n".join(self.simulator.said)
        for shown, real in self.ports.items():
            said = said.replace(real, shown)
        return said

    def stop(self):
        """Ends what runs."""
        if network := self.names.pop("network", None):
            network.disconnect()
        if self.simulator:
            self.simulator.end()
        self.simulator, self.ports, self.names = None, {}, {}

    def real(self, text):
        """Text of the page with the ports of this module."""
        for shown, real in self.ports.items():
            text = text.replace(shown, real)
        return text

    def world(self, words):
        """Carries out `tmcl world`, and gives the answers."""
        words = [self.real(word) for word in words]
        return subprocess.run([self.binary, *words], capture_output=True, text=True, timeout=PATIENCE).stdout

    def command(self, line):
        """Carries out a command of the page, and gives what it says."""
        words = shlex.split(line)
        if words[:2] in (["tmcl", "sim"], ["cargo", "sim"]):
            return self.start(words[2:])
        if words[:2] == ["tmcl", "world"]:
            return self.world(words[1:])
        raise ValueError(f"a command that this test does not know: {line}")

    def console(self, piece):
        """Does what a block with commands shows."""
        for part in re.split(r"^\$ ", piece.text, flags=re.MULTILINE)[1:]:
            line, _, shown = part.partition("\n")
            told(f"{piece.place}: {line}", shown, self.command(line))

    def python(self, piece):
        """Runs a piece of a program."""
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), deadline():
            exec(compile(self.real(piece.text), piece.place, "exec"), self.names)
        told(piece.place, piece.prints, printed.getvalue())


def tmcl(binary, line):
    """Carries out a command on a module with the TMCL firmware."""
    with tempfile.TemporaryDirectory() as folder:
        port = str(Path(folder) / "port")
        module = Simulator(binary, "--serial", port)
        words = [port if word == SERIAL else word for word in shlex.split(line)]
        done = subprocess.run([binary, *words[1:]], cwd=folder, capture_output=True, text=True, timeout=PATIENCE)
        equal(line.strip(), (done.returncode, port in words), (0, True))
        module.end()


def main():
    options = command_line("Does what docs/canopen.md shows.")
    binary = str(Path(options.binary).resolve())
    os.chdir(ROOT)
    be_patient()
    found = sections(PAGE)
    first = {}
    for piece in (piece for blocks in found for piece in blocks):
        check(f"{piece.place}: {piece.language}", piece.language in ("console", "python", "command"))
        first.setdefault(piece.language, piece)
    start, _, _ = first["console"].text.removeprefix("$ ").partition("\n")
    node = re.match(r"(?s).*?add_node\(.*?\n", first["python"].text)[0]
    for blocks in found:
        reader = Reader(binary)
        try:
            for piece in blocks:
                print(f"{piece.place}: {piece.language}", flush=True)
                if piece.language == "command":
                    tmcl(binary, piece.text)
                elif piece.language == "console":
                    reader.console(piece)
                else:
                    if not reader.simulator:
                        reader.command(start)
                    if not reader.names and not piece.text.startswith("import"):
                        exec(reader.real(node), reader.names)
                    reader.python(piece)
        except Exception as error:  # One section that fails shall not hide the others.
            check(piece.place, False, repr(error))
        finally:
            reader.stop()
    conclude()


if __name__ == "__main__":
    main()
