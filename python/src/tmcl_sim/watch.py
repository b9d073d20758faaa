"""Values that are told again and again as virtual time passes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType, TracebackType
from typing import Any

from .control import Connection
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
    """How many samples before this one are lost, because nobody has read them."""

    def __getitem__(self, name: str) -> float | None:
        return self.values[name]


class Watch:
    """Samples of values at each interval of virtual time, whatever lets it pass. `Module.watch` makes one.

    It has a connection of its own, so a thread may iterate over it while others use the simulator. It goes on after
    `Sim.restart`, with the time beginning anew, and ends with the simulator.
    """

    def __init__(self, process: Process, command: str):
        self._connection = Connection(process)
        self._command = command
        self._connection.ask(command)
        self._stopping = self._ended = False

    def samples(self) -> list[Sample]:
        """All samples that have come since the last call, without waiting for more."""
        self._mark()
        return list(self._up_to_mark())

    def stop(self) -> None:
        """No more samples come. Those that have come can still be iterated over; then the iteration ends. A second time
        does nothing."""
        if not self._stopping:
            self._stopping = True
            self._connection.write("unwatch")
            self._mark()

    def close(self) -> None:
        """Ends the watch and its connection. A second time does nothing."""
        self._connection.close()

    def begin_anew(self) -> None:
        """Goes on after a restart, with which the watch has ended for the simulator."""
        if not self._stopping:
            self._connection.write(self._command)

    def __iter__(self) -> Iterator[Sample]:
        while not self._ended:
            yield from self._up_to_mark()
            self._ended = self._stopping

    def _mark(self) -> None:
        """Has the simulator mark this place among the samples, by an answer that no other command has."""
        self._connection.write("state")

    def _up_to_mark(self) -> Iterator[Sample]:
        while "axes" not in (line := self._connection.read()):
            if not line.keys() & {"ok", "ended"}:
                yield _sample(line)

    def __del__(self) -> None:
        self.close()

    def __enter__(self) -> Watch:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _sample(line: dict[str, Any]) -> Sample:
    values = {name: value for name, value in line.items() if name not in ("time_us", "missed")}
    return Sample(seconds(line), MappingProxyType(values), line.get("missed", 0))
