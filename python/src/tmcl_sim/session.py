"""What all modules of a simulator share: its process, the connection to its control port, and the watches."""

from __future__ import annotations

import weakref
from typing import Any

from .control import Connection
from .happenings import Happenings
from .process import Process
from .watch import Watch

# pytest leaves the frames of this file out of tracebacks: the line of the test is what matters.
__tracebackhide__ = True


class Session:
    """A running simulator and all connections to its control port."""

    def __init__(self, process: Process):
        self.process = process
        self._control = Connection(process)
        self._watches: weakref.WeakSet[Watch] = weakref.WeakSet()
        # What was made to happen around the modules, once somebody wants that to be noted.
        self._happenings: Happenings | None = None

    def ask(self, line: str) -> dict[str, Any]:
        """Carries out a command of the control port and gives the fields of the answer."""
        answer = self._control.ask(line)
        if self._happenings:
            self._happenings.note(line, answer, self._control.ask)
        return answer

    def record_happenings(self) -> Happenings:
        """From now on it is noted what is made to happen around the modules."""
        self._happenings = Happenings()
        return self._happenings

    def watch(self, command: str, kept: int | None) -> Watch:
        """A watch that begins with this command, and keeps so many samples at most."""
        watch = Watch(self.process, command, kept)
        self._watches.add(watch)
        return watch

    def restart(self) -> None:
        """All begins anew, and the watches go on."""
        self.ask("restart")
        if self._happenings:
            self._happenings.begin_anew()
        for watch in list(self._watches):
            watch.begin_anew()

    def end(self) -> None:
        """Ends the simulator, and then the connections to it. A second time does nothing."""
        self.process.end()
        self._control.close()
        for watch in list(self._watches):
            watch.close()
