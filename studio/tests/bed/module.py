"""A virtual module: `tmcl sim` with a serial port, its control port and its log of telegrams."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any

from . import PATIENCE

ROOT = Path(__file__).parents[3]
# The program may be named by this variable; else it is the one that `cargo build` makes.
PROGRAM = Path(os.environ.get("TMCL_SIM_BINARY", ROOT / "target" / "debug" / "tmcl"))


class VirtualModule:
    """A running `tmcl sim`, whose USB link is a serial port at the path `serial`.

    `arguments` are further ones of `tmcl sim`. What it tells when it is ready is in `ready`. It ends with the `with`
    block, and also if this interpreter is killed.
    """

    def __init__(self, serial: Path, folder: Path, *arguments: str):
        self.serial = serial
        self.log = folder / f"{serial.name}.telegrams"
        self._said = folder / f"{serial.name}.stderr"
        options = ["--ready-json", "--exit-with-stdin", "--control", "127.0.0.1:0"]
        options += ["--serial", str(serial), "--log-telegrams", str(self.log), *arguments]
        with open(self._said, "wb") as said:
            self._process = subprocess.Popen(
                [PROGRAM, "sim", *options],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=said,
                # A process group of its own: Ctrl-C at the terminal is for the tests alone.
                start_new_session=True,
            )
        try:
            assert self._process.stdout
            line = self._process.stdout.readline()
            if not line:
                raise RuntimeError(f"tmcl sim has not become ready: {self._said.read_text()}")
            self.ready: dict[str, Any] = json.loads(line)
            host, _, port = self.ready["control"].rpartition(":")
            self._control = socket.create_connection((host, int(port)), timeout=PATIENCE)
        except BaseException:
            self._end_process()
            raise
        self._lines = self._control.makefile("rw")

    def __enter__(self) -> VirtualModule:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def ask(self, line: str) -> dict[str, Any]:
        """Carries out a line of the control protocol, docs/control.md, and gives the fields of the answer."""
        self._lines.write(line + "\n")
        self._lines.flush()
        answer: dict[str, Any] = json.loads(self._lines.readline())
        if not answer["ok"]:
            raise RuntimeError(f"{line}: {answer['error']}")
        return answer

    def telegrams(self) -> list[str]:
        """The lines of the log so far: virtual time, link, direction, bytes and what they say."""
        return self.log.read_text().splitlines()

    def wait_for_telegrams(self, *parts: str) -> None:
        """Waits until each of these parts of lines is in the log, in this order."""
        end = time.monotonic() + PATIENCE
        while True:
            lines = iter(self.telegrams())
            if all(any(part in line for line in lines) for part in parts):
                return
            if time.monotonic() > end:
                raise TimeoutError(f"not in the log in this order: {parts}; it has\n" + "\n".join(self.telegrams()))
            time.sleep(0.02)

    def first(self, part: str) -> int:
        """The number of the first line of the log that has this part."""
        return next(number for number, line in enumerate(self.telegrams()) if part in line)

    def close(self) -> None:
        """Ends it, and waits until it has ended. A second time does nothing."""
        with suppress(OSError):
            self._lines.close()
        self._control.close()
        self._end_process()

    def _end_process(self) -> None:
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.close()
        try:
            self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
        self._process.stdout.close()
