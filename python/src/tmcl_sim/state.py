"""The state of a module, as the control port tells it: all fields of docs/control.md, under the same names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal


@dataclass(frozen=True)
class Switches:
    """Levels of the switches of an axis: true is pressed, but released for a normally closed switch."""

    left: bool
    """The left stop switch."""
    right: bool
    """The right stop switch."""
    home: bool
    """The home switch."""


@dataclass(frozen=True)
class Axis:
    """The state of an axis."""

    position: int
    """The position in the motion controller, in microsteps."""
    velocity: int
    """The speed in the motion controller, in its units: -2047 to 2047 of a TMC429, 0.954 microsteps/s of a TMC5160."""
    rotor: int
    """Where the rotor is, in 1/256 full steps."""
    field: int
    """Where it would be without lost steps, in 1/256 full steps."""
    lost_steps: int
    """How many full steps the rotor has lost since power-on; negative when it is ahead."""
    bridges_on: bool
    """Whether the driver's bridges are on."""
    current: int
    """The driver's effective current, 0 to 32, in 1/32 of full scale."""
    stall_guard: int
    """The driver's last stallGuard2 value, 0 to 1023."""
    load: float
    """The load on the motor, 0 to 1, as a fraction of its torque at full current."""
    switches: Switches
    """The switches."""
    encoder: int
    """The built-in encoder, 0 to 1023 in 1/1024 turns; 0 where there is none."""
    abn: int
    """The count of an ABN encoder, in encoder steps."""


@dataclass(frozen=True)
class State(Axis):
    """The state of a module. The fields of an axis are here those of axis 0; `axes` has them of each axis."""

    time_us: int
    """Virtual time since the simulator's start, in microseconds."""
    time: Literal["running", "paused"]
    """Whether time goes by the clock."""
    power: bool
    """Whether the module has power."""
    inputs: tuple[bool, ...]
    """Levels of the digital inputs, IN0 first."""
    analog: int
    """Reading of the first analog input, 0 to 4095."""
    analogs: tuple[int, ...]
    """Readings of all analog inputs, 0 to 4095, in the order of their numbers."""
    outputs: tuple[bool, ...]
    """The digital outputs, OUT0 first."""
    pull_ups: bool
    """Whether the first group of pull-up resistors at the inputs is on."""
    pull_up_groups: tuple[bool, ...]
    """Whether they are on, group by group."""
    leds: tuple[bool, ...]
    """LED1 and LED2."""
    can: Literal["on", "passive", "off"]
    """The CAN controller."""
    supply: float
    """The supply voltage, in V."""
    temperature: int
    """The temperature of the board, in degrees Celsius."""
    axes: tuple[Axis, ...]
    """The axes, axis 0 first."""
    speed_factor: float = field(compare=False)
    """How fast virtual time has been going lately by the computer's clock; 1 is real time. States that differ only in
    this are equal."""
    speed_wanted: float | None
    """How fast it should go by the clock; None is as fast as it can."""
    enable: bool | None = None
    """Level of the ENABLE input of a TMCM-3212; None of others."""

    @classmethod
    def of(cls, answer: Mapping[str, Any]) -> State:
        """The state in an answer of the control port."""
        return cls(**_fields(cls, answer) | {"axes": tuple(Axis(**_fields(Axis, axis)) for axis in answer["axes"])})


def _fields(kind: type[Axis], answer: Mapping[str, Any]) -> dict[str, Any]:
    found = {each.name: answer[each.name] for each in fields(kind) if each.name in answer}
    lists = {name: tuple(value) for name, value in found.items() if isinstance(value, list)}
    return found | lists | {"switches": Switches(**found["switches"])}


def value_of(state: State, name: str) -> float | None:
    """The number that a name in a condition stands for - `rotor`, `rotor 2`, `switches.left`, `inputs.3` - or None if
    the state has none of that name. As in conditions, `time` is in milliseconds and `can` is 2, 1 or 0."""
    if name == "time":
        return state.time_us / 1000
    if name == "can":
        return ("off", "passive", "on").index(state.can)
    path, _, axis = name.partition(" ")
    found: Any = state
    try:
        if axis:
            found = state.axes[int(axis)]
        for step in path.split("."):
            found = found[int(step)] if isinstance(found, tuple) else getattr(found, step)
    except (AttributeError, IndexError, ValueError):
        return None
    return float(found) if isinstance(found, (bool, int, float)) else None
