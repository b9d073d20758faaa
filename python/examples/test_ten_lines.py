"""The whole test of a stop switch, in ten lines."""

import pytest


@pytest.mark.tmcl_sim(world="stage.toml")
def test_the_motor_stops_at_the_switch(virtual_module):
    virtual_module.send("SAP 12, 0, 0")  # the right switch stops the motor
    virtual_module.send("MVP ABS, 0, 51200")
    virtual_module.at(0.5, "press right")
    virtual_module.step(1.0)
    assert virtual_module.state().velocity == 0
    assert 0 < virtual_module.state().rotor < 51200
