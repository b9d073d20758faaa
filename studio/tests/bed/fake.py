"""A module that is not as it should be: a pseudo terminal whose other end is the test's."""

from __future__ import annotations

import os
import select
import threading
import time
import tty
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

from . import PATIENCE

# Bytes of a telegram.
TELEGRAM = 9


def reply(request: bytes, value: int, status: int = 100) -> bytes:
    """The reply of a module with address 1 to a request."""
    first = bytes([2, 1, status, request[1]]) + value.to_bytes(4, "big", signed=True)
    return first + bytes([sum(first) & 0xFF])


class Fake:
    """A serial port at the path `serial`, where `answer` says what comes of each request of nine bytes."""

    def __init__(self, serial: Path, answer: Callable[[bytes], bytes]):
        self.requests: list[bytes] = []
        self._answer = answer
        self._end, self._device = os.openpty()
        tty.setraw(self._device)
        serial.symlink_to(os.ttyname(self._device))
        self._ends, self._ending = os.pipe()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def __enter__(self) -> Fake:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.close(self._ending)
        self._thread.join()
        for end in (self._ends, self._device, self._end):
            os.close(end)

    def say(self, bytes_: bytes) -> None:
        """Sends bytes that no request asks for now."""
        os.write(self._end, bytes_)

    def wait_for(self, beginning: bytes) -> None:
        """Waits for a request that begins so."""
        end = time.monotonic() + PATIENCE
        while not any(request.startswith(beginning) for request in self.requests):
            if time.monotonic() > end:
                raise TimeoutError(f"no request begins with {beginning.hex(' ')}")
            time.sleep(0.02)

    def _serve(self) -> None:
        heard = b""
        while True:
            ready, _, _ = select.select([self._end, self._ends], [], [])
            if self._ends in ready:
                return
            heard += os.read(self._end, 64)
            while len(heard) >= TELEGRAM:
                request, heard = heard[:TELEGRAM], heard[TELEGRAM:]
                self.requests.append(request)
                os.write(self._end, self._answer(request))
