"""A virtual module as a test sees it: telegrams to it, and what happens around it."""

from __future__ import annotations

import re
from typing import Any, Literal

from .errors import NoReply, NotMet, Refused
from .reply import Reply
from .session import Session
from .state import State, value_of
from .times import seconds, span
from .watch import Watch

# pytest leaves the frames of this file out of tracebacks: the line of the test is what matters.
__tracebackhide__ = True

# The names of switches, and of faults of the board or an axis, as the control port has them.
Switch = Literal["left", "right", "home"]
Fault = Literal[
    "eeprom",
    "spi",
    "spi-low",
    "tmc429",
    "tmc262",
    "tmc5160",
    "chip-supply",
    "short-a",
    "short-b",
    "open-a",
    "open-b",
    "overtemperature",
    "encoder",
]


class Module:
    """One of the modules of a `Sim`; `Sim.module` gives it.

    What the simulator refuses raises SimError with its words, and changes nothing.
    """

    # A misspelled property is an error, in place of a new attribute that does nothing.
    __slots__ = ("__weakref__", "_session", "number")

    def __init__(self, session: Session, number: int):
        self._session = session
        self.number = number
        """The number of the module, from 1 on."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.number}: {self.product}>"

    @property
    def product(self) -> str:
        """What the module is, such as "TMCM-1140"."""
        return str(self._session.process.ready["products"][self.number - 1])

    def _ask(self, command: str) -> dict[str, Any]:
        return self._session.ask(f"module {self.number} {command}")

    # Telegrams and state.

    def send(self, command: str, *, check: bool = True) -> Reply:
        """Sends a TMCL command, such as "MVP ABS, 0, 51200" or "GAP 1, 0", over a USB link of its own.

        Raises Refused if the module answers with the status of an error, unless `check` is false, and NoReply if no
        reply comes or a torn one."""
        answer = self._ask(f"send {command}")
        if "error" in answer:
            raise NoReply(f"{command}: {answer['error']}")
        reply = Reply.of(answer)
        if check and not reply.is_ok:
            raise Refused(reply)
        return reply

    def state(self) -> State:
        """The state of the module and of all around it. To look at it takes no time and changes nothing."""
        return State.of(self._ask("state"))

    # What happens around the module.

    def axis(self, number: int) -> Motor:
        """The motor of an axis, from 0 on. Raises SimError if there is none."""
        # The simulator knows which axes there are. A blow of no steps changes nothing.
        self.slip(0, number)
        return Motor(self, number)

    def press(self, switch: Switch, axis: int = 0) -> None:
        """A hand closes a switch. It stays closed until it is released, wherever the stage is."""
        self._ask(f"press {switch}{_of(axis)}")

    def release(self, switch: Switch, axis: int = 0) -> None:
        """The hand lets go of a switch; the stage decides again."""
        self._ask(f"release {switch}{_of(axis)}")

    def input(self, number: int, level: bool) -> None:
        """Sets the level of a digital input, from 0 on. Where a switch is connected to it, that is pressed or
        released."""
        self._ask(f"input {number} {int(level)}")

    def analog(self, number: int, reading: int) -> None:
        """Sets the reading of an analog input, 0 to 4095."""
        self._ask(f"analog {number} {reading}")

    @property
    def load(self) -> float:
        """A torque against the motor of axis 0, 0 to 1, as a fraction of its torque at full current: 1 stalls it."""
        return self.axis(0).load

    @load.setter
    def load(self, load: float) -> None:
        self.axis(0).load = load

    def slip(self, steps: int, axis: int = 0) -> None:
        """A blow turns the rotor by full steps, -1000000 to 1000000, without the motion controller knowing."""
        self._ask(f"slip {steps}{_of(axis)}")

    @property
    def supply(self) -> float:
        """The supply voltage in V, 0 to 60, rounded to tenths."""
        return self.state().supply

    @supply.setter
    def supply(self, volts: float) -> None:
        self._ask(f"supply {volts}")

    @property
    def temperature(self) -> int:
        """The temperature of the board in whole degrees Celsius, -55 to 200."""
        return self.state().temperature

    @temperature.setter
    def temperature(self, celsius: float) -> None:
        if celsius != int(celsius):
            raise ValueError(f"the temperature is a whole number of degrees Celsius, not {celsius}")
        self._ask(f"temperature {int(celsius)}")

    def power(self, on: bool) -> None:
        """The module loses its power (False), or starts anew (True). The EEPROM and the world keep what they have."""
        self._ask(f"power {_on('power', on)}")

    def usb(self, on: bool, hangup: bool = False) -> None:
        """The USB cable is pulled out or plugged in. With `hangup` hosts see that it is out: their connections end."""
        level = _on("usb", on)
        self._ask("usb off --hangup" if hangup and not on else f"usb {level}")

    def can_state(self, state: Literal["on", "passive", "off"]) -> None:
        """What disturbances on the bus have made of the CAN controller: it does not tell others of errors any more
        (passive), takes no part in the bus (off), or is as it should be (on)."""
        self._ask(f"can {state}")

    # Faults.

    def fault(self, name: Fault, on: bool = True, axis: int | None = None) -> None:
        """A fault begins or ends. Those of the board, which take no axis, are eeprom, spi and spi-low; those of an axis
        tmc429, tmc262, tmc5160, chip-supply, short-a, short-b, open-a, open-b, overtemperature and encoder."""
        level = _on("fault", on, f'"{name}", ')
        self._ask(f"fault {name} {level}" + ("" if axis is None else f" {axis}"))

    def reply_delay(self, delay: float) -> None:
        """Replies come later by so many seconds of virtual time; 0 ends it."""
        self._ask(f"fault reply-delay {span(delay)}")

    def reply_drop(self, count: int) -> None:
        """The next replies, so many of them, are lost; 0 ends it."""
        self._ask(f"fault reply-drop {count}")

    def reply_corrupt(self, count: int) -> None:
        """The next replies, so many of them, have a wrong checksum; 0 ends it."""
        self._ask(f"fault reply-corrupt {count}")

    # Time.

    def at(self, delay: float, command: str) -> float:
        """Puts off a command of the control port, such as "power off" or "press left", by seconds of virtual time,
        however it passes: also within a step, or while a request is served. Gives the virtual time in seconds at which
        that will be."""
        return seconds(self._session.ask(f"at {span(delay)} module {self.number} {command}"))

    def run_until(self, condition: str, *, max: float) -> float:  # noqa: A002
        """Lets paused time pass until a condition holds, such as "velocity = 0" or "rotor 2 = 51200 +- 4", which is
        looked at now and each millisecond; `max` seconds at most. Gives the virtual time in seconds at which it was
        met.

        Raises NotMet if it was not.
        """
        answer = self._ask(f"run-until {condition} max {span(max)}")
        if not answer["met"]:
            state = self.state()
            raise NotMet(condition, max, state, _values(condition, state))
        return seconds(answer)

    def watch(self, interval: float, *names: str, kept: int | None = None) -> Watch:
        """Tells values each time `interval` seconds of virtual time have passed, 0.0001 or more. Names are those of
        conditions: "position", "rotor 2", "GAP 4, 0". With `kept` only so many of the last samples are kept."""
        return self._session.watch(f"module {self.number} watch {span(interval)} {' '.join(names)}", kept)


class Motor:
    """The motor and the stage of an axis; `Module.axis` gives it."""

    __slots__ = ("_module", "number")

    def __init__(self, module: Module, number: int):
        self._module = module
        self.number = number
        """The number of the axis, from 0 on."""

    @property
    def load(self) -> float:
        """A torque against the motor, 0 to 1, as a fraction of its torque at full current: 1 stalls it."""
        return self._module.state().axes[self.number].load

    @load.setter
    def load(self, load: float) -> None:
        self._module._ask(f"load {load}{_of(self.number)}")

    def slip(self, steps: int) -> None:
        """A blow turns the rotor by full steps, -1000000 to 1000000, without the motion controller knowing."""
        self._module.slip(steps, self.number)

    def press(self, switch: Switch) -> None:
        """A hand closes a switch of this axis."""
        self._module.press(switch, self.number)

    def release(self, switch: Switch) -> None:
        """The hand lets go of a switch of this axis."""
        self._module.release(switch, self.number)


def _of(axis: int) -> str:
    """The number of an axis behind a command, which without one is for axis 0."""
    return f" {axis}" if axis else ""


def _on(method: str, on: bool, before: str = "") -> str:
    """The level of a call such as `power(True)`; `before` are its arguments before that."""
    if on not in (False, True):
        raise TypeError(f"{method}({before}{on!r}): write {method}({before}True) or {method}({before}False)")
    return "on" if on else "off"


def _values(condition: str, state: State) -> dict[str, float]:
    """The values of the state that a condition names."""
    names = re.findall(r"\b[a-z_][a-z_0-9.]*(?: \d+)?", condition)
    values = ((name, value_of(state, name)) for name in names)
    return {name: value for name, value in values if value is not None}
