"""A mutant: one small change of one source file."""

from dataclasses import dataclass
from enum import Enum


class Form(Enum):
    """How the change stands in the source beside the original, so that one build has all mutants."""

    EXPRESSION = "an expression in place of another"
    STATEMENT = "a statement that is left out"
    ARM = "an arm of a match that is never taken"
    ALONE = "no place for a choice while the program runs, as in a constant: a build of its own"


@dataclass(frozen=True)
class Mutant:
    """The bytes `start..end` of a file become `text`."""

    path: str
    start: int
    end: int
    text: bytes
    form: Form
    line: int
    what: str
    """The change in a few words."""

    def place(self) -> str:
        return f"{self.path}:{self.line}"
