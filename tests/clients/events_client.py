#!/usr/bin/env python3
"""Drives a virtual TMCM-6110 and TMCM-3212 over CAN as published drivers do that wait for the event of command 138: with
frames of seven bytes, and a mask of all axes that there could be.

    python3 tests/clients/events_client.py target/debug/tmcl
    python3 tests/clients/events_client.py target/debug/tmcl --product 6110 \
        --image target/thumbv7em-none-eabi/release/tmcm6110

With --image the module is the flash image on the emulated microcontroller. Starts `tmcl sim` itself.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import functools
import struct
import time

import can
from virtual_module import PATIENCE, check, drive, equal

MODULE, HOST = 1, 2
MVP, SAP, GAP, RFS, EVENT = 4, 5, 6, 13, 138
OK, REACHED = 100, 128
EVERY_MOVE, ALL_AXES = 1, 255
# The axes that are driven.
AXES = {"6110": (0, 2, 5), "3212": (0, 1, 2)}


def world(axes):
    """A home switch at each axis, further away for each."""
    switch = "[[axis]]\n[axis.stage]\nhome = [{}, {}]\n"
    return "".join(switch.format(3000 + 500 * axis, 3400 + 500 * axis) for axis in range(max(axes) + 1))


class Driver:
    """A driver on the bus: one request at a time; events come when they come."""

    def __init__(self, simulator):
        channel = f"socket://{simulator.told['slcan-tcp']}"
        self.bus = can.Bus(interface="slcan", channel=channel, bitrate=1_000_000, sleep_after_open=0)
        self.events = []

    def ask(self, opcode, kind, motor, value):
        """Sends a request and gives the value of its reply."""
        data = struct.pack(">BBBi", opcode, kind, motor, value)
        self.bus.send(can.Message(arbitration_id=MODULE, data=data, is_extended_id=False))
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            reply = self.receive(end - time.monotonic())
            if reply:
                status, answered, value = reply
                equal(f"reply to {opcode}", (status, answered), (OK, opcode))
                return value
        raise TimeoutError(f"no reply to {opcode}")

    def receive(self, timeout):
        """The reply in the next frame; None if there is no frame, or an event in it."""
        frame = self.bus.recv(timeout)
        if frame is None:
            return None
        equal("identifier and length", (frame.arbitration_id, frame.dlc), (HOST, 7))
        _, status, opcode, value = struct.unpack(">BBBi", frame.data)
        if (status, opcode) == (REACHED, EVENT):
            self.events.append(value)
            return None
        return status, opcode, value

    def wait(self, what, axes):
        """Waits for the events of axes, and a moment longer: each is to come once."""
        expected = sorted(1 << axis for axis in axes)
        end = time.monotonic() + PATIENCE
        while len(self.events) < len(expected) and time.monotonic() < end:
            self.receive(0.1)
        while self.receive(0.5):
            pass
        equal(what, sorted(self.events), expected)
        self.events.clear()


def session(axes, simulator):
    driver = Driver(simulator)
    try:
        events(driver, axes, simulator)
    finally:
        driver.bus.shutdown()


def events(driver, axes, simulator):
    equal("mask of all axes", driver.ask(EVENT, EVERY_MOVE, 0, ALL_AXES), ALL_AXES)
    for turn, distance in enumerate((2000, 900, -2900)):
        for axis in axes:
            driver.ask(MVP, 1, axis, distance - 100 * axis)
        driver.wait(f"events of the moves of turn {turn}", axes)
    for axis in axes:
        driver.ask(MVP, 0, axis, 0)
    driver.wait("events of the way to zero", axes)
    for axis in axes:
        driver.ask(SAP, 193, axis, 7)
        driver.ask(RFS, 0, axis, 0)
    driver.wait("events of the searches", axes)
    for axis in axes:
        equal(f"axis {axis} does not search any more", driver.ask(RFS, 2, axis, 0), 0)
        equal(f"axis {axis} is at zero", driver.ask(GAP, 1, axis, 0), 0)
        rotor = simulator.control("state")["axes"][axis]["rotor"]
        check(f"axis {axis} is at its home switch", abs(rotor - 3200 - 500 * axis) < 20, rotor)
    # Three axes to where coordinates say, by one command.
    for axis in axes:
        driver.ask(30, 5, axis, 1000 * (axis + 1))
    driver.ask(MVP, 2, 0x80 | sum(1 << axis for axis in axes), 5)
    driver.wait("events of a common start", axes)
    equal("places", [driver.ask(GAP, 1, axis, 0) for axis in axes], [1000 * (axis + 1) for axis in axes])


if __name__ == "__main__":
    courses = {product: (functools.partial(session, axes), world(axes)) for product, axes in AXES.items()}
    drive("Waits for the events of a virtual module over CAN.", courses, "--slcan-tcp", "127.0.0.1:0")
