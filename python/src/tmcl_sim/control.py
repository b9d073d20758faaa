"""A connection to the control port of a simulator: a line of text out, a line of JSON in."""

from __future__ import annotations

import json
import socket
import threading
from collections import deque
from contextlib import suppress
from typing import Any

from .errors import SimError
from .process import Process

# pytest leaves the frames of this file out of tracebacks: the line of the test is what matters.
__tracebackhide__ = True

# How many bytes are taken from the socket at a time.
CHUNK = 1 << 16


class Connection:
    """A connection, made when it is first used.

    Several threads may ask: one of them has its turn at a time, and the others wait. If an exception such as
    KeyboardInterrupt comes between a question and its answer, what the simulator is doing for it is interrupted, and
    the next question goes over a new connection.
    """

    def __init__(self, process: Process):
        self._process = process
        self._turn = threading.Lock()
        self._socket: socket.socket | None = None
        self._lines: deque[bytes] = deque()
        self._rest = b""
        # Whether the next line is the answer to an interruption, which nobody has waited for.
        self._interrupted = False

    def ask(self, line: str) -> dict[str, Any]:
        """Carries out a command and gives the fields of the answer. Raises SimError with the simulator's words if it is
        refused."""
        if "\n" in line or "\r" in line:
            raise SimError(f"a command is one line, and this is more: {line!r}")
        with self._turn:
            try:
                self.write(line)
                if self._interrupted:
                    self._answer()
                    self._interrupted = False
                answer = self._answer()
            except BaseException:
                self._interrupt()
                raise
        if not answer["ok"]:
            raise SimError(answer["error"])
        return answer

    def _interrupt(self) -> None:
        """Ends a step or the like that is under way. Its answer is left for the next question, as a simulator that does
        not answer is not to keep the exception from its way."""
        self.close()
        with suppress(SimError):
            self.write("interrupt")
            self._interrupted = True

    def write(self, line: str) -> None:
        """Sends a line."""
        self._process.check()
        try:
            self._connected().sendall(line.encode() + b"\n")
        except OSError:
            raise self._process.gone() from None

    def line(self) -> bytes:
        """Waits for the next line that the simulator sends; an empty one is the end of the connection."""
        while not self._lines:
            data = b""
            if connection := self._socket:
                # Another thread may close it meanwhile.
                with suppress(OSError):
                    data = connection.recv(CHUNK)
            if not data:
                return b""
            *lines, self._rest = (self._rest + data).split(b"\n")
            self._lines.extend(lines)
        return self._lines.popleft()

    def _answer(self) -> dict[str, Any]:
        line = self.line()
        if not line:
            self._process.check()
            raise self._process.gone()
        return dict(json.loads(line))

    def _connected(self) -> socket.socket:
        if self._socket is None:
            host, _, port = self._process.ready["control"].rpartition(":")
            self._socket = socket.create_connection((host, int(port)))
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return self._socket

    def wake(self) -> None:
        """Whoever waits for a line finds the end of the connection."""
        # A fork has a copy of the connection, and is not to end that of its parent.
        if self._socket and self._process.is_own:
            with suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Ends the connection. Who waits for a line of it is woken."""
        self.wake()
        if self._socket:
            self._socket.close()
        self._socket, self._rest, self._interrupted = None, b"", False
        self._lines.clear()
