"""Records the motion of a module's axes while a test runs, and what the test makes happen around it, for the plot in
the report of a test that fails."""

from __future__ import annotations

from .errors import SimError
from .happenings import Happenings
from .module import Module
from .plot import Curve, Mark, Panel
from .watch import Sample

# Virtual time between two samples, in seconds, and how many are kept: those of the last ten seconds.
INTERVAL, KEPT = 0.010, 1000
# The units of the speed register, which are a matter of the motion controller.
SPEED_UNITS = {"TMCM-3212": "0.954 microsteps/s"}


class Recorder:
    """Keeps the last samples of position and speed of all axes of a module. What happens around it is noted in
    `happenings`."""

    def __init__(self, module: Module, happenings: Happenings):
        self._number, self._product = module.number, module.product
        self._happenings = happenings
        self._axes = range(len(module.state().axes))
        self._samples: list[Sample] = []
        names = [_name(value, axis) for axis in self._axes for value in ("position", "velocity")]
        self._watch = module.watch(INTERVAL, *names, kept=KEPT)

    def end(self) -> None:
        """Ends the record. What it has can still be told. A second time does nothing."""
        self._catch_up()
        self._watch.close()

    def _catch_up(self) -> None:
        """Adds what has happened up to now."""
        try:
            samples = self._watch.samples()
        except SimError:
            # Of a simulator that has died or was closed there is what was read until then.
            samples = self._watch.rest()
        for sample in samples:
            if self._samples and sample.time <= self._samples[-1].time:
                # After a restart time has begun anew.
                self._samples.clear()
            self._samples.append(sample)

    @property
    def missed(self) -> int:
        """How many samples are missing between those of the panels."""
        return sum(sample.missed for sample in self._samples[1:])

    def panels(self) -> list[Panel]:
        """What was recorded up to now."""
        self._catch_up()
        speed = SPEED_UNITS.get(self._product, "internal units")
        return [
            Panel("position in microsteps", [self._curve("position", axis) for axis in self._axes]),
            Panel(f"speed in {speed}", [self._curve("velocity", axis) for axis in self._axes]),
        ]

    def marks(self) -> list[Mark]:
        """What has happened around the module since the sample before the first one of the panels."""
        if not self._samples:
            return []
        begin, now = self._samples[0].time - INTERVAL, self._samples[-1].time
        return [Mark(each.time, each.what) for each in self._happenings.of(self._number, begin, now)]

    def _curve(self, value: str, axis: int) -> Curve:
        name = _name(value, axis)
        points = [(sample.time, found) for sample in self._samples if (found := sample.values.get(name)) is not None]
        return Curve(f"axis {axis}", points)


def _name(value: str, axis: int) -> str:
    """The name of a value of an axis, as the simulator writes it."""
    return f"{value} {axis}" if axis else value
