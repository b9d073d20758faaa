"""Tests of homing.py, which is not changed for them: its module is a virtual one.

The script asks again and again whether the motor has arrived. With `paused=0.010` each reply lets 10 ms of virtual time
pass, so its questions alone decide how far the motor gets, and each run has the same numbers.
"""

import pytest

import homing
from tmcl_sim import Sim

pytestmark = pytest.mark.tmcl_sim(world="stage.toml", paused=0.010)

# Where the left switch of stage.toml closes, in 1/256 full steps: the zero of all positions after homing.
SWITCH = -20000
# The maximum current (axis parameter 6) of a fresh module.
FACTORY_CURRENT = 128


@pytest.fixture(autouse=True)
def no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """The script does not have to sleep between its questions: no virtual time passes meanwhile."""
    monkeypatch.setattr(homing, "POLL", 0)


def test_homes_and_moves(virtual_module: Sim) -> None:
    assert homing.main([*virtual_module.pytrinamic.split(), "100000", "50000"]) == 0
    state = virtual_module.state()
    assert state.position == 50000
    assert state.lost_steps == 0
    # The fine search ends within a full step of the switch.
    assert state.rotor == pytest.approx(SWITCH + 50000, abs=256)


def test_a_pressed_switch_ends_the_move(virtual_module: Sim, capsys: pytest.CaptureFixture[str]) -> None:
    virtual_module.at(4.0, "press right")
    assert homing.main([*virtual_module.pytrinamic.split(), "300000"]) == 1
    assert "the switch is pressed at" in capsys.readouterr().err
    assert virtual_module.state().velocity == 0


def test_a_stall_ends_the_move(virtual_module: Sim, capsys: pytest.CaptureFixture[str]) -> None:
    virtual_module.at(4.0, "load 1")
    assert homing.main([*virtual_module.pytrinamic.split(), "300000"]) == 1
    assert "stalled at" in capsys.readouterr().err
    assert virtual_module.state().velocity == 0


@pytest.mark.tmcl_sim(serial=True)
def test_a_power_cut_while_the_current_is_stored(virtual_module: Sim, capsys: pytest.CaptureFixture[str]) -> None:
    # Over a serial port PyTrinamic gives up after a time; over TCP it would wait for ever.
    arguments = ["--interface", "serial_tmcl", "--port", virtual_module.serial, "--timeout", "1"]
    # The store is the second command.
    virtual_module.at(0.0125, "power off")
    assert homing.main([*arguments, "50000"]) == 1
    assert "is its power on?" in capsys.readouterr().err

    virtual_module.power(True)
    virtual_module.step(0.1)
    assert virtual_module.send("GAP 6, 0").value == FACTORY_CURRENT
    assert homing.main([*arguments, "50000"]) == 0

    virtual_module.power(False)
    virtual_module.power(True)
    virtual_module.step(0.1)
    assert virtual_module.send("GAP 6, 0").value == homing.CURRENT
