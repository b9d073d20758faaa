"""What a test has made happen around modules - switches pressed, loads, faults, power cuts - and when, for plots."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from .times import seconds

# How many are kept, of all modules together: the last ones.
KEPT = 100
# The commands of the control port for the world around a module, which `at` may put off. A blow of no steps is none.
COMMAND = re.compile(
    r"\s*(?P<at>at\s+[\d.]+\s*[a-z]+\s+)?(?:module\s+(?P<module>\d+)\s+)?"
    r"(?P<what>(?:press|release|input|analog|supply|temperature|load|slip(?!\s+0\b)|fault|can|power|usb)\s.*)"
)


class Happening(NamedTuple):
    """Something that has happened around a module, or will because it was put off."""

    module: int
    """The number of the module."""
    time: float
    """Virtual time in seconds."""
    what: str
    """The command."""


class Happenings:
    """The last commands that a test has given for the world around the modules."""

    def __init__(self) -> None:
        self._last: deque[Happening] = deque(maxlen=KEPT)
        # Virtual time at the last of them that was not put off.
        self._now = 0.0

    def note(self, line: str, answer: dict[str, Any], ask: Callable[[str], dict[str, Any]]) -> None:
        """Takes note of a line for the control port that was carried out. `ask` asks for the virtual time, which not
        every answer tells."""
        if found := COMMAND.fullmatch(line):
            time = seconds(answer if found["at"] else ask("state"))
            if not found["at"]:
                self._now = time
            self._last.append(Happening(int(found["module"] or 1), time, " ".join(found["what"].split())))

    def begin_anew(self) -> None:
        """Forgets all: after a restart it has not happened."""
        self._last.clear()
        self._now = 0.0

    def of(self, module: int, begin: float, now: float) -> list[Happening]:
        """What has happened around a module from `begin` on, in its order. It is `now` at least; what was put off to a
        later time has not happened."""
        end = max(now, self._now)
        found = [each for each in self._last if each.module == module and begin <= each.time <= end]
        return sorted(found, key=lambda each: each.time)
