"""The whole test of a stop switch, in ten lines."""

import pytest


@pytest.mark.tmcl_sim(world="stage.toml")
def test_the_motor_stops_at_the_switch(tmcl_sim):
    tmcl_sim.send("SAP 12, 0, 0")  # the right switch stops the motor
    tmcl_sim.send("MVP ABS, 0, 51200")
    tmcl_sim.at(0.5, "press right")
    tmcl_sim.step(1.0)
    assert tmcl_sim.state().velocity == 0
    assert 0 < tmcl_sim.state().rotor < 51200
