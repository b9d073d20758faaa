"""Values that are told again and again as virtual time passes."""

from __future__ import annotations

import json
import threading
import weakref
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType, TracebackType

from .control import Connection
from .errors import SimError
from .process import Process
from .times import seconds

# pytest leaves the frames of this file out of tracebacks: the line of the test is what matters.
__tracebackhide__ = True


@dataclass(frozen=True)
class Sample:
    """Values at a moment of virtual time; `sample["position"]` is one of them."""

    time: float
    """Virtual time in seconds."""
    values: Mapping[str, float | None]
    """The values by their names as the simulator writes them (`rotor 2`); None for one that cannot be told now."""
    missed: int
    """How many samples before this one are lost, because the computer was too busy to read them."""

    def __getitem__(self, name: str) -> float | None:
        return self.values[name]


class Watch:
    """Samples of values at each interval of virtual time, whatever lets it pass. `Module.watch` makes one.

    Samples are read as they come, by a thread of the watch, and kept until they are asked for. To iterate over a watch
    is the same as over `samples()`: it gives what has come, and ends; while time goes by the clock, ask again for more.
    It goes on after `Sim.restart`, with the time beginning anew, and ends with the simulator.
    """

    def __init__(self, process: Process, command: str, kept: int | None = None):
        self._process = process
        self._command = command
        connection = Connection(process)
        try:
            connection.ask(command)
        except BaseException:
            connection.close()
            raise
        self._reader = _Reader(connection, kept)
        self._stopped = False
        # A watch that nobody has closed is closed when it is forgotten, or when the interpreter ends.
        self._finalizer = weakref.finalize(self, self._reader.end)

    def samples(self) -> list[Sample]:
        """All samples that have come since the last call, in their order, up to the virtual time of now. It does not
        wait for more to come."""
        self._catch_up()
        return self.rest()

    def rest(self) -> list[Sample]:
        """The samples that were read since the last call; unlike `samples` also those of a watch that has ended."""
        return [_sample(line) for line in self._reader.take()]

    def stop(self) -> None:
        """No more samples come; `samples` still gives those that have come. A second time does nothing."""
        if not self._stopped and self._finalizer.alive:
            self._stopped = True
            self._reader.connection.write("unwatch")
            self._catch_up()

    def _catch_up(self) -> None:
        self._process.check()
        if not self._finalizer.alive:
            raise SimError("this watch is closed")
        if not self._reader.catch_up():
            self._process.check()
            raise self._process.gone()

    def close(self) -> None:
        """Ends the watch, its connection and its thread. A second time does nothing."""
        self._finalizer()

    def begin_anew(self) -> None:
        """Goes on after a restart, with which the watch has ended for the simulator."""
        if not self._stopped and self._finalizer.alive:
            self._reader.connection.write(self._command)

    def __iter__(self) -> Iterator[Sample]:
        return iter(self.samples())

    def __enter__(self) -> Watch:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Reader:
    """The thread that reads the lines of a watch, so that the simulator can always send. It does not know the watch,
    which can thus be forgotten."""

    def __init__(self, connection: Connection, kept: int | None):
        self.connection = connection
        self._lines: deque[bytes] = deque(maxlen=kept)
        # How often `catch_up` has asked the simulator for its state, and how many of these answers were read.
        self._asked = self._answered = 0
        self._ended = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="tmcl_sim watch", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while line := self.connection.line():
            if line.startswith(b'{"time_us"'):
                self._lines.append(line)
            elif b'"axes"' in line:
                with self._changed:
                    self._answered += 1
                    self._changed.notify_all()
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def catch_up(self) -> bool:
        """Waits until all that the simulator has sent up to now was read: an answer that no other command has marks the
        place. False if the connection ends meanwhile."""
        with self._changed:
            self._asked += 1
            mark = self._asked
            self.connection.write("state")
            self._changed.wait_for(lambda: self._ended or self._answered >= mark)
            return self._answered >= mark

    def take(self) -> list[bytes]:
        """The lines of samples since the last call."""
        with self._changed:
            return [self._lines.popleft() for _ in range(len(self._lines))]

    def end(self) -> None:
        """Ends connection and thread."""
        self.connection.wake()
        # The watch may be forgotten while the thread itself tidies up.
        if self._thread is not threading.current_thread():
            self._thread.join()
        self.connection.close()


def _sample(line: bytes) -> Sample:
    fields = json.loads(line)
    values = {name: value for name, value in fields.items() if name not in ("time_us", "missed")}
    return Sample(seconds(fields), MappingProxyType(values), fields.get("missed", 0))
