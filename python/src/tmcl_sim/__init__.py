"""Virtual TMCM stepper motor modules for Python test suites.

`Sim` starts the program `tmcl` of this package and stops it again. Host software (PyTrinamic, python-canopen, a script
of your own) connects to it as to a real module, while the test decides what happens around the module and how time
passes:

    with tmcl_sim.Sim(world="stage.toml") as sim:
        sim.send("MVP ABS, 0, 51200")
        sim.run_until("position = 51200", max=5.0)

The pytest plugin (`pytest_plugin.py`) gives the same as the fixture `virtual_module`. Where a time is wanted or told,
it is virtual time in seconds."""

from .errors import Died, NoReply, NotMet, Refused, SimError, StartError
from .installation import binary
from .module import Fault, Module, Motor, Switch
from .reply import Reply
from .sim import Sim
from .state import Axis, State, Switches
from .watch import Sample, Watch

__all__ = [
    "Axis",
    "Died",
    "Fault",
    "Module",
    "Motor",
    "NoReply",
    "NotMet",
    "Refused",
    "Reply",
    "Sample",
    "Sim",
    "SimError",
    "StartError",
    "State",
    "Switch",
    "Switches",
    "Watch",
    "binary",
]
