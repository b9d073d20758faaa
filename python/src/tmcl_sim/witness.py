"""What the report of a failing test tells of its simulator: the last telegrams, the state, and a plot of the motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, fields
from typing import NamedTuple

from .errors import SimError
from .module import Module
from .plot import as_svg, as_text
from .recorder import Recorder
from .sim import Sim
from .state import Axis, Switches

# How many telegrams are told.
LAST_TELEGRAMS = 20
# Of how many modules the motion is recorded: each recorder takes one of the simulator's 16 connections.
MOST_RECORDED = 4


class Section(NamedTuple):
    """A section of the report; one with a plot has its image as SVG as well."""

    title: str
    text: str
    image: str | None = None


class Witness:
    """Watches a simulator for as long as a test runs."""

    def __init__(self, sim: Sim):
        self._sim = sim
        self._modules = [sim.module(number) for number in range(1, len(sim.ready["products"]) + 1)]
        self._recorders = [Recorder(module) for module in self._modules[:MOST_RECORDED]]

    def end(self) -> None:
        """Ends all records. A second time does nothing."""
        for recorder in self._recorders:
            recorder.end()

    def sections(self, test: str) -> Iterator[Section]:
        """The sections for the report of a test. Ends the records."""
        self.end()
        yield Section("last telegrams", self._telegrams())
        for module in self._modules:
            yield Section(f"state of {_name(module)}", _state(module))
        for module, recorder in zip(self._modules, self._recorders, strict=False):
            panels = recorder.panels()
            text = as_text(panels)
            if recorder.missed:
                text += f"\n\n{recorder.missed} samples are missing: the computer was too busy to read them"
            yield Section(f"motion of {_name(module)}", text, as_svg(f"{test}: {_name(module)}", panels))

    def _telegrams(self) -> str:
        try:
            return "\n".join(self._sim.telegrams(last=LAST_TELEGRAMS)) or "none"
        except SimError as error:
            return str(error)


def _name(module: Module) -> str:
    return f"module {module.number}, {module.product}"


def _state(module: Module) -> str:
    """All fields of the state, a line each; those of the axes have a column for each axis."""
    try:
        state = module.state()
    except SimError as error:
        return str(error)
    of_axis = [field.name for field in fields(Axis)]
    of_module = [field.name for field in fields(state) if field.name not in (*of_axis, "axes")]
    rows = [[name, _words(value)] for name in of_module if (value := getattr(state, name)) is not None]
    table = [["", *(f"axis {number}" for number in range(len(state.axes)))]]
    table += [[name, *(_words(getattr(axis, name)) for axis in state.axes)] for name in of_axis]
    return "\n".join("".join(f"{cell:16}" for cell in row).rstrip() for row in rows + table)


def _words(value: object) -> str:
    """A value of the state: of several levels those that are high."""
    if isinstance(value, Switches):
        return " ".join(name for name, pressed in asdict(value).items() if pressed) or "none pressed"
    if isinstance(value, tuple):
        return " ".join(str(int(element)) for element in value)
    return str(value)
