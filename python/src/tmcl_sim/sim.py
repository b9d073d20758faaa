"""A simulator: virtual modules with ports of their own, and time that the test controls."""

from __future__ import annotations

import itertools
import os
import re
import weakref
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Literal

from .errors import SimError
from .installation import binary as find_binary
from .module import Module
from .process import Process, link_path
from .session import Session
from .times import seconds, span

# pytest leaves the frames of this file out of tracebacks: the line of the test is what matters.
__tracebackhide__ = True

# An address of this computer alone, with a free port.
ANY_PORT = "127.0.0.1:0"

File = str | os.PathLike[str]

# All that have been started and not been forgotten, by the order of their starts.
_numbers = itertools.count()
_all: weakref.WeakValueDictionary[int, Sim] = weakref.WeakValueDictionary()


def open_sims() -> list[Sim]:
    """Those of this process that nobody has closed, the oldest first."""
    return [sim for _, sim in sorted(_all.items()) if sim._finalizer.alive]


class Sim(Module):
    """A simulator with one module or several. It is module 1, and more; `module` gives the others.

    world:    path of the file (TOML) that describes motor, stage and switches; without one each axis has a free motor.
    paused:   True lets virtual time stand still but for what requests need; a number is the seconds of it that pass
              after each reply as well, for scripts that ask and sleep; with False it goes by the clock.
    product:  "1140", or another one that `tmcl sim --help` lists, or one for each of several modules; without it that
              of the image, or "1140".
    firmware: "tmcl" or "canopen"; without it that of the image, or "tmcl".
    modules:  how many modules there are; without it as many as products.
    speed:    how fast time goes by the clock, 0.001 to 1000, or "max".
    eeprom:   path of a file that keeps what the module stores, and is made if there is none.
    image:    path of a flash image (ELF) that runs in place of the firmware's core.
    log:      path of a file that gets a line for each telegram; one that exists is emptied.
    serial:   whether the USB link is a serial port as well; its path is then `serial`.
    rs485:    the same for the RS485 bus of all modules.
    can:      whether there is a CAN adapter for the bus of all modules; firmware="canopen" brings one.
    binary:   path of the program `tmcl`, in place of `tmcl_sim.binary()`.

    Raises StartError, with the simulator's words, if it does not start. It is to be closed, by `close` or a `with`
    block.
    """

    __slots__ = ("_finalizer",)

    def __init__(
        self,
        world: File | None = None,
        *,
        paused: bool | float = True,
        product: str | Sequence[str] | None = None,
        firmware: Literal["tmcl", "canopen"] | None = None,
        modules: int | None = None,
        speed: float | Literal["max"] = 1.0,
        eeprom: File | None = None,
        image: File | None = None,
        log: File | None = None,
        serial: bool = False,
        rs485: bool = False,
        can: bool = False,
        binary: File | None = None,
    ):
        arguments = ["--tcp", ANY_PORT, "--control", ANY_PORT, f"--speed={speed}"]
        if paused is not False:
            arguments.append("--paused" if paused is True else f"--paused={span(paused)}")
        if product is not None:
            arguments.append(f"--product={product if isinstance(product, str) else ','.join(product)}")
        if can or firmware == "canopen":
            arguments += ["--slcan-tcp", ANY_PORT]
        links = {option: link_path(option) for option, wanted in (("serial", serial), ("rs485", rs485)) if wanted}
        given = {"world": world, "firmware": firmware, "modules": modules, "eeprom": eeprom, "image": image, **links}
        for option, value in given.items():
            if value is not None:
                # In one word, so that a value may begin with a dash.
                arguments.append(f"--{option}={value}")
        program = os.fspath(binary) if binary is not None else find_binary()
        # An absolute path, so that no name has a meaning of its own to the simulator.
        kept = os.path.abspath(log) if log is not None else None
        session = Session(Process(program, arguments, list(links.values()), kept))
        super().__init__(session, 1)
        # A Sim that nobody has closed is closed when it is forgotten, or when the interpreter ends.
        self._finalizer = weakref.finalize(self, session.end)
        _all[next(_numbers)] = self

    def close(self) -> None:
        """Ends the simulator, and waits until nothing is left of it. A second time does nothing."""
        self._finalizer()

    def __enter__(self) -> Sim:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def module(self, number: int) -> Module:
        """A module, from 1 on; module 1 is the Sim itself."""
        count = len(self.ready["products"])
        if not 1 <= number <= count:
            raise SimError(f"no module {number}: there {'is 1 module' if count == 1 else f'are {count} modules'}")
        return self if number == 1 else Module(self._session, number)

    def control(self, line: str) -> dict[str, Any]:
        """Carries out any command of the control port (docs/control.md), and gives the fields of the answer. In place
        of its `watch` there is `Module.watch`."""
        if re.match(r"\s*(module\s+\d+\s+)?(un)?watch\b", line):
            raise SimError(
                f'{line!r}: samples come by a connection of their own; write watch = sim.watch(0.010, "rotor"), '
                "watch.samples() and watch.close()"
            )
        return self._session.ask(line)

    # Time.

    @property
    def time(self) -> float:
        """Virtual time in seconds since the start."""
        return seconds(self._ask("state"))

    def step(self, time: float) -> float:
        """Lets `time` seconds pass, an hour at most, while time is paused. Gives the virtual time in seconds then."""
        return seconds(self.control(f"step {span(time)}"))

    def pause(self, after_reply: float = 0.0) -> None:
        """Time stands still from now on, but for what requests need, and `after_reply` seconds after each reply."""
        self.control(f"pause {span(after_reply)}")

    def resume(self) -> None:
        """Time goes by the clock again."""
        self.control("resume")

    @property
    def speed(self) -> float | Literal["max"]:
        """How fast time goes by the clock: 0.001 to 1000, or "max" for as fast as the computer can."""
        wanted = self.state().speed_wanted
        return "max" if wanted is None else wanted

    @speed.setter
    def speed(self, speed: float | Literal["max"]) -> None:
        self.control(f"speed {speed}")

    def restart(self) -> None:
        """All begins anew, as if the simulator had been started now. EEPROMs keep their contents, and links stay."""
        self._session.restart()

    # What has happened, and where the modules are reached.

    def telegrams(self, last: int | None = None) -> list[str]:
        """The telegrams on all links so far, or the last of them, a line each: virtual time in seconds, link,
        direction, bytes and what they say. A simulator that has died tells them as well."""
        return self._session.process.telegrams(last)

    @property
    def ready(self) -> dict[str, Any]:
        """What the simulator has told when it was ready: version, products, process and all ports."""
        return self._session.process.ready

    @property
    def pytrinamic(self) -> str:
        """The arguments for PyTrinamic's ConnectionManager, which a script takes on its command line as well."""
        return f"--interface socket_serial_tmcl --port {self.tcp}"

    @property
    def python_canopen(self) -> dict[str, Any]:
        """The arguments for `canopen.Network.connect` and `can.Bus` of python-canopen and python-can."""
        return {
            "interface": "slcan",
            "channel": f"socket://{self.can}",
            "bitrate": 1_000_000,
            "sleep_after_open": 0,
        }

    @property
    def tcp(self) -> str:
        """The address of the USB link of module 1: "127.0.0.1:PORT"."""
        return str(self.ready["tcp"])

    @property
    def can(self) -> str:
        """The address of the CAN adapter (SLCAN): "127.0.0.1:PORT"."""
        return self._offered("slcan_tcp", "CAN adapter", "can")

    @property
    def serial(self) -> str:
        """The path of the serial port of the USB link of module 1."""
        return self._offered("serial", "serial port", "serial")

    @property
    def rs485(self) -> str:
        """The path of the serial port of the RS485 bus."""
        return self._offered("rs485", "RS485 port", "rs485")

    def _offered(self, entry: str, what: str, argument: str) -> str:
        if self.ready[entry] is None:
            raise SimError(f"there is no {what}: ask for one, as in Sim({argument}=True)")
        return str(self.ready[entry])
