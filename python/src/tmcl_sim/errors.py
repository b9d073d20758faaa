"""What can go wrong, as exceptions. Their texts are the simulator's words wherever it has said something."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .reply import Reply
    from .state import State


class SimError(Exception):
    """The simulator refuses a command, or cannot be asked any more; the base of all exceptions of this package."""


class StartError(SimError):
    """The simulator has not started; the text has the last lines that it has written."""


class Died(SimError):
    """The simulator has ended although nobody has closed it."""

    def __init__(self, exit_code: int, last_lines: str):
        super().__init__(exit_code, last_lines)
        self.exit_code = exit_code
        """The exit code of its process; -9 if signal 9 has killed it."""
        self.last_lines = last_lines
        """The last lines that it has written to its standard error."""

    def __str__(self) -> str:
        said = f"; its last lines:\n{self.last_lines}" if self.last_lines else " without a word"
        return f"the simulator has ended with {_ending(self.exit_code)}{said}"


class Refused(SimError):
    """The module has answered a TMCL command with the status of an error."""

    def __init__(self, reply: Reply):
        super().__init__(reply)
        self.reply = reply
        """What the module has answered."""

    def __str__(self) -> str:
        return f"{self.reply.command}: status {self.reply.status} {self.reply.meaning or ''}".rstrip()


class NoReply(SimError):
    """No reply has come to a TMCL command, or a torn one."""


class NotMet(SimError):
    """A condition has not come to hold within the time that it had."""

    def __init__(self, condition: str, longest: float, state: State, values: dict[str, float]):
        super().__init__(condition, longest, state, values)
        self.condition = condition
        """What was waited for."""
        self.longest = longest
        """How long, in seconds of virtual time."""
        self.state = state
        """The state of the module now."""
        self.values = values
        """The values of the state that the condition names, now."""

    def __str__(self) -> str:
        now = ", ".join(f"{name} = {value:g}" for name, value in self.values.items())
        return f"not within {self.longest:g} s: {self.condition}" + (f" (now {now})" if now else "")


def _ending(exit_code: int) -> str:
    if exit_code >= 0:
        return f"exit code {exit_code}"
    try:
        return f"signal {signal.Signals(-exit_code).name}"
    except ValueError:
        return f"signal {-exit_code}"
