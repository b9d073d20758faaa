"""Homes a linear stage on its left switch and moves it, with Trinamic's PyTrinamic: a script as it runs on a real
TMCM-1140.

    python homing.py --interface usb_tmcl --port /dev/ttyACM0 100000 0

It knows nothing of the virtual module; test_homing.py shows how it is tested with one.
"""

import argparse
import sys
import time
from collections.abc import Sequence

from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM1140

# The motor is made for 1.1 A; 255 is 2 A.
CURRENT = 140
# Speed in internal units of the module, and the speed above which a stall stops the motor.
SPEED, STALL_SPEED = 1000, 500
# What stallGuard2 takes for a stall with this motor at this speed.
STALL_THRESHOLD = 2
# Seconds between two questions to the module.
POLL = 0.01
# Types of the command RFS.
START, STATUS = 0, 2
# A bit of the extended error flags.
STALLED = 1


class Stopped(Exception):
    """The motor has stopped short of its target."""


class Stage:
    """A stage on axis 0 of a TMCM-1140."""

    def __init__(self, connection):
        self.connection = connection
        self.motor = TMCM1140(connection).motors[0]
        self.parameters = self.motor.AP

    def set_up(self):
        """Sets what the motor needs. Its current is stored, so that it is right after a power cut, too."""
        self.motor.set_axis_parameter(self.parameters.MaxCurrent, CURRENT)
        self.connection.store_axis_parameter(self.parameters.MaxCurrent, 0)
        self.motor.set_axis_parameter(self.parameters.LeftLimitSwitchDisable, 0)
        self.motor.set_axis_parameter(self.parameters.RightLimitSwitchDisable, 0)
        self.motor.linear_ramp.max_velocity = SPEED
        self.motor.stallguard2.set_filter(0)
        self.motor.stallguard2.set_threshold(STALL_THRESHOLD)

    def home(self):
        """Searches the left switch, which is position 0 from then on."""
        self.motor.stallguard2.set_stop_velocity(0)
        self.connection.reference_search(START, 0)
        while self.connection.reference_search(STATUS, 0):
            time.sleep(POLL)

    def move_to(self, position):
        """Moves to a position in microsteps. Raises Stopped if a switch or a stall is in the way."""
        rightward = position > self.motor.actual_position
        switch = self.parameters.RightEndstop if rightward else self.parameters.LeftEndstop
        self.motor.stallguard2.set_stop_velocity(STALL_SPEED)
        self.motor.move_to(position)
        while not self.motor.get_position_reached():
            if self.motor.get_axis_parameter(self.parameters.ExtendedErrorFlags) & STALLED:
                raise Stopped(f"stalled at {self.motor.actual_position}: is anything in the way?")
            if self.motor.get_axis_parameter(switch):
                self.motor.stop()
                raise Stopped(f"the switch is pressed at {self.motor.actual_position}")
            time.sleep(POLL)


def main(arguments: Sequence[str]) -> int:
    """Homes and moves to the positions in the arguments. The exit code is 1 if that has not succeeded."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ConnectionManager.argparse(parser)
    parser.add_argument("positions", nargs="*", type=int, help="where to move, in microsteps from the left switch")
    positions = parser.parse_args(arguments).positions
    try:
        with ConnectionManager(list(arguments)).connect() as connection:
            stage = Stage(connection)
            stage.set_up()
            stage.home()
            for position in positions:
                stage.move_to(position)
                print(f"at {position}")
    except Stopped as stopped:
        print(stopped, file=sys.stderr)
        return 1
    except (ConnectionError, RuntimeError) as error:
        print(f"the module does not answer ({error}): is its power on?", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
