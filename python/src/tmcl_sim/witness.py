"""What the report of a failing test tells of simulators: the last telegrams, the state, and a plot of the motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, fields
from typing import NamedTuple

from .errors import SimError
from .module import Module
from .plot import as_svg, as_text
from .recorder import INTERVAL, Recorder
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
        self.sim = sim
        happenings = sim._session.record_happenings()
        self._recorders = [Recorder(module, happenings) for module in _modules(sim)[:MOST_RECORDED]]
        self._last: list[Section] | None = None

    def end(self) -> None:
        """Takes note of how it is now, before the simulator ends, and ends the records."""
        self._last = list(sections(self.sim))
        for recorder in self._recorders:
            recorder.end()

    def sections(self, test: str) -> Iterator[Section]:
        """The sections for the report of a test, of now or of the end."""
        yield from sections(self.sim) if self._last is None else self._last
        for module, recorder in zip(_modules(self.sim), self._recorders, strict=False):
            yield _motion(test, module, recorder)


def sections(sim: Sim, of: str = "") -> Iterator[Section]:
    """The sections that there are of any simulator; `of` tells which one, for their titles."""
    yield Section(f"last telegrams{of}", _telegrams(sim))
    for module in _modules(sim):
        yield Section(f"state of {_name(module)}{of}", _state(module))


def _modules(sim: Sim) -> list[Module]:
    return [sim.module(number) for number in range(1, len(sim.ready["products"]) + 1)]


def _motion(test: str, module: Module, recorder: Recorder) -> Section:
    title = f"motion of {_name(module)}"
    panels = recorder.panels()
    most = max(len(curve.points) for panel in panels for curve in panel.curves)
    if most < 2:
        told = "only one" if most else "none"
        words = f"no plot: a sample is taken each {INTERVAL * 1000:g} ms of virtual time, and there has been {told}"
        return Section(title, words)
    marks = recorder.marks()
    text = as_text(panels, marks)
    if recorder.missed:
        text += f"\n\n{recorder.missed} samples are missing: the computer was too busy to read them"
    return Section(title, text, as_svg(f"{test}: {_name(module)}", panels, marks))


def _telegrams(sim: Sim) -> str:
    try:
        return "\n".join(sim.telegrams(last=LAST_TELEGRAMS)) or "none"
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
    # What goes by the computer's clock says nothing of the module.
    of_module = [field.name for field in fields(state) if field.name not in of_axis and field.compare]
    of_module.remove("axes")
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
