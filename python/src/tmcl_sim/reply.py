"""The reply of a module to a TMCL command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

# Statuses of success: carried out, and put into the program memory.
SUCCESS = (100, 101)


@dataclass(frozen=True, repr=False)
class Reply:
    """What a module has answered. What it has not told is None, but for the value; after a command that is not replied
    to, such as 137, there is the command alone."""

    command: str
    """The command, as the simulator has understood it."""
    status: int | None = None
    """The status: 100 is success."""
    value: int = 0
    """The value; 0 if none was told, as of a command that was refused or is not replied to."""
    meaning: str | None = None
    """What the status means."""
    unit: str | None = None
    """The unit of the value, where it has one."""
    name: str | None = None
    """What the value is, such as the name of a parameter."""
    text: str | None = None
    """The version string, of the command that asks for it."""

    @classmethod
    def of(cls, answer: Mapping[str, Any]) -> Reply:
        """The reply in an answer of the control port."""
        return cls(**{field.name: answer[field.name] for field in fields(cls) if field.name in answer})

    @property
    def is_ok(self) -> bool:
        """False if the module has refused the command."""
        return self.status is None or self.status in SUCCESS

    def __repr__(self) -> str:
        told = ((field.name, getattr(self, field.name)) for field in fields(self))
        return f"Reply({', '.join(f'{name}={value!r}' for name, value in told if value is not None)})"
