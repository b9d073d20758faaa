"""What happens around a module, as the module and its state tell it."""

from __future__ import annotations

import dataclasses
import json
import re
import socket
from collections.abc import Callable, Iterator
from typing import get_args

import pytest

from tmcl_sim import Fault, Module, NoReply, Refused, Sim, SimError

# A short of bridge A among the driver's error flags.
SHORT_A = 8
AXES = {"1140": 1, "1110": 1, "3110": 3, "3212": 3, "6110": 6}


@pytest.fixture
def sim() -> Iterator[Sim]:
    with Sim() as sim:
        yield sim


def read(module: Module, command: str) -> int:
    return module.send(command).value


def test_a_reply_has_all_that_the_module_has_said(sim: Sim) -> None:
    reply = sim.send("MVP ABS, 0, 51200")
    assert (reply.status, reply.value, reply.meaning) == (100, 51200, "ok")
    assert (reply.unit, reply.name, reply.is_ok) == ("microsteps", "target", True)
    assert repr(sim.send("GAP 6, 0")) == (
        "Reply(command='GAP 6, 0', status=100, value=128, meaning='ok', unit='1/255', name='maximum current')"
    )
    assert sim.send("136, 0").text == "1140V142"


def test_a_command_without_reply_has_no_status(sim: Sim) -> None:
    reply = sim.send("137, 0, 0, 1234")
    assert (reply.status, reply.value, reply.is_ok) == (None, 0, True)


def test_a_refused_command_raises_or_is_told(sim: Sim) -> None:
    with pytest.raises(Refused, match=r"^SAP 4, 0, 5000: status 4 value, motor or bank out of range$") as refused:
        sim.send("SAP 4, 0, 5000")
    assert refused.value.reply == sim.send("SAP 4, 0, 5000", check=False)
    assert (refused.value.reply.status, refused.value.reply.value, refused.value.reply.is_ok) == (4, 0, False)


@pytest.mark.parametrize("product", AXES)
def test_the_state_is_complete(product: str) -> None:
    with Sim(product=product) as sim:
        state = sim.state()
        told = sim.control("state")
        assert len(state.axes) == AXES[product]
        assert (state.enable is None) == (product != "3212")
    del told["ok"], told["speed_factor"]
    found = {name: value for name, value in dataclasses.asdict(state).items() if name in told}
    assert json.loads(json.dumps(found)) == told


def test_the_fields_of_axis_0_are_those_of_the_state(sim: Sim) -> None:
    sim.slip(3)
    state = sim.state()
    assert all(
        getattr(state, field.name) == getattr(state.axes[0], field.name) for field in dataclasses.fields(state.axes[0])
    )
    with pytest.raises(dataclasses.FrozenInstanceError):
        state.rotor = 1  # type: ignore[misc]


def test_switches(sim: Sim) -> None:
    sim.press("left")
    assert sim.state().switches.left
    assert read(sim, "GAP 11, 0") == 1
    sim.release("left")
    assert not sim.state().switches.left
    assert read(sim, "GAP 11, 0") == 0


def test_inputs(sim: Sim) -> None:
    sim.input(3, True)
    sim.step(0.1)
    assert sim.state().inputs[3]
    assert read(sim, "GIO 3, 0") == 1
    sim.input(3, False)
    assert not sim.state().inputs[3]
    sim.analog(0, 1234)
    sim.step(0.1)
    assert sim.state().analogs == (1234,)
    assert read(sim, "GIO 0, 1") == 1234


def test_supply_and_temperature(sim: Sim) -> None:
    assert (sim.supply, sim.temperature) == (24.0, 25)
    sim.supply = 12.5
    sim.temperature = 40
    assert (sim.supply, sim.temperature) == (12.5, 40)
    sim.temperature = 40.0
    with pytest.raises(ValueError, match=r"^the temperature is a whole number of degrees Celsius, not 25\.5$"):
        sim.temperature = 25.5
    sim.step(0.1)
    assert read(sim, "GIO 8, 1") == 125
    assert read(sim, "GIO 9, 1") == 40


def test_load_and_slip(sim: Sim) -> None:
    sim.load = 0.25
    assert sim.load == sim.state().load == 0.25
    sim.slip(4)
    sim.step(0.1)
    assert sim.state().lost_steps == -4


def test_axes_have_motors_of_their_own() -> None:
    with Sim(product="3110") as sim:
        motor = sim.axis(2)
        motor.load = 0.5
        motor.slip(4)
        motor.press("left")
        state = sim.state()
        assert [axis.load for axis in state.axes] == [0.0, 0.0, 0.5]
        assert motor.load == 0.5
        assert [axis.lost_steps for axis in state.axes] == [0, 0, -4]
        assert [axis.switches.left for axis in state.axes] == [False, False, True]
        motor.release("left")
        assert not sim.state().axes[2].switches.left
        sim.press("home", axis=1)
        assert sim.state().axes[1].switches.home
        with pytest.raises(SimError, match=r"^no axis 3: the TMCM-3110 has axes 0 to 2$"):
            sim.axis(3)
        before = sim.state()
        sim.axis(1)
        assert sim.state() == before


def test_power(sim: Sim) -> None:
    sim.power(False)
    assert not sim.state().power
    with pytest.raises(NoReply, match=r"^GAP 1, 0: no reply"):
        sim.send("GAP 1, 0")
    sim.power(True)
    sim.step(0.1)
    assert sim.state().power
    assert read(sim, "GAP 1, 0") == 0


def test_usb(sim: Sim) -> None:
    host, _, port = sim.tcp.rpartition(":")
    with socket.create_connection((host, int(port))) as connection:
        sim.usb(False, hangup=True)
        assert connection.recv(1) == b""
    sim.usb(True)
    sim.usb(False)
    with pytest.raises(NoReply):
        sim.send("GAP 1, 0")
    # Who plugs it in hangs nobody up.
    sim.usb(True, hangup=True)
    assert read(sim, "GAP 1, 0") == 0


def test_can_state(sim: Sim) -> None:
    for state in ("passive", "off", "on"):
        sim.can_state(state)
        assert sim.state().can == state


def test_faults(sim: Sim) -> None:
    sim.fault("short-a", axis=0)
    sim.step(0.1)
    assert read(sim, "GAP 208, 0") & SHORT_A
    sim.fault("short-a", on=False, axis=0)
    sim.send("SAP 6, 0, 77")
    sim.fault("eeprom")
    with pytest.raises(Refused):
        sim.send("STAP 6, 0")
    sim.fault("eeprom", on=False)
    assert sim.send("STAP 6, 0").status == 100
    with pytest.raises(SimError, match=r"^unknown fault 'fire'; there are: eeprom, spi") as unknown:
        sim.fault("fire")  # type: ignore[arg-type]
    # The last three are those of replies, which have methods of their own.
    known = str(unknown.value).partition("there are: ")[2].split(", ")
    assert list(get_args(Fault)) == known[:-3]


def test_faults_of_an_axis() -> None:
    with Sim(product="3110") as sim:
        sim.fault("short-a", axis=1)
        sim.step(0.1)
        assert [bool(read(sim, f"GAP 208, {axis}") & SHORT_A) for axis in range(3)] == [False, True, False]


def test_faults_of_replies(sim: Sim) -> None:
    sim.reply_drop(1)
    with pytest.raises(NoReply):
        sim.send("GAP 6, 0")
    sim.reply_corrupt(1)
    with pytest.raises(NoReply, match="checksum"):
        sim.send("GAP 6, 0")
    before = sim.time
    assert read(sim, "GAP 6, 0") == 128
    on_time = sim.time - before
    sim.reply_delay(0.020)
    before = sim.time
    assert read(sim, "GAP 6, 0") == 128
    assert sim.time - before == pytest.approx(on_time + 0.020)


def test_modules_of_several_products() -> None:
    with Sim(product=("1140", "6110"), modules=2) as sim:
        second = sim.module(2)
        assert (sim.product, second.product, second.number) == ("TMCM-1140", "TMCM-6110", 2)
        assert repr(second) == "<Module 2: TMCM-6110>"
        assert sim.module(1) is sim
        assert second.send("MVP ABS, 5, 1000").value == 1000
        second.load = 0.5
        assert second.run_until("rotor 5 = 1000", max=1.0) == sim.time
        assert (sim.load, second.load) == (0.0, 0.5)
        second.at(0.001, "power off")
        sim.step(0.002)
        assert (sim.state().power, second.state().power) == (True, False)
        with pytest.raises(SimError, match=r"^no module 3: there are 2 modules$"):
            sim.module(3)
    with Sim(modules=3) as sim:
        assert sim.ready["products"] == ["TMCM-1140"] * 3


def test_a_refused_command_changes_nothing(sim: Sim) -> None:
    before = sim.state()
    with pytest.raises(SimError, match=r"^load '2' is not a number within 0 to 1$"):
        sim.load = 2
    with pytest.raises(SimError, match=r"^a command is one line"):
        sim.control("state\nstate")
    with pytest.raises(AttributeError):
        sim.laod = 0.5  # type: ignore[attr-defined]
    assert sim.state() == before


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda sim: sim.power("off"), "power('off'): write power(True) or power(False)"),
        (lambda sim: sim.usb(2), "usb(2): write usb(True) or usb(False)"),
        (lambda sim: sim.usb("on", hangup=True), "usb('on'): write usb(True) or usb(False)"),
        (
            lambda sim: sim.fault("short-a", "off"),
            'fault("short-a", \'off\'): write fault("short-a", True) or fault("short-a", False)',
        ),
    ],
)
def test_on_and_off_are_true_and_false(sim: Sim, call: Callable[[Sim], None], words: str) -> None:
    before = sim.state()
    with pytest.raises(TypeError, match=f"^{re.escape(words)}$"):
        call(sim)
    assert sim.state() == before
    sim.power(0)  # type: ignore[arg-type]
    assert not sim.state().power


def test_a_state_is_equal_however_fast_time_goes(sim: Sim) -> None:
    state = sim.state()
    assert dataclasses.replace(state, speed_factor=2.0) == state
    assert dataclasses.replace(state, temperature=26) != state


@pytest.mark.parametrize("line", ["watch 10 ms rotor", "module 1 watch 10 ms rotor", "unwatch"])
def test_a_watch_is_no_line_of_control(sim: Sim, line: str) -> None:
    with pytest.raises(SimError, match=r'write watch = sim\.watch\(0\.010, "rotor"\)'):
        sim.control(line)
