#!/usr/bin/env python3
"""Drives the motor of a virtual module with the CANopen firmware by python-canopen's BaseNode402, unmodified.

    python3 tests/clients/canopen_drive.py target/debug/tmcl [--image target/thumbv7em-none-eabi/release/tmcm1140-canopen]

Starts `tmcl sim --firmware canopen` itself, on a stage with limit switches and a home switch.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import contextlib
import logging
import tempfile
from pathlib import Path

from canopen.profiles.p402 import BaseNode402, State402
from canopen.sdo import SdoAbortedError
from canopen_bus import Bus, emergency, reboot
from virtual_module import PATIENCE, Simulator, check, command_line, conclude, equal, wait_for

# Positions are in 1/256 full steps, which are microsteps here. The switches are closed at their places.
LEFT, RIGHT, HOME = -30_000, 560_000, (-2_560, 2_560)
STAGE = f"[stage]\nleft = {LEFT}\nright = {RIGHT}\nhome = [{HOME[0]}, {HOME[1]}]\n"
# How exactly a limit switch is found, and how exactly an edge of the home switch at 6099h.2 = 200.
LATCHED, POLLED = 8, 7
FAR = 500_000
# Microsteps a second of a speed of 1 in internal units.
UNIT = 16_000_000 / (2048 * 32 * 8)
MODES = ("NO MODE", "PROFILED POSITION", "VELOCITY", "PROFILED VELOCITY", "HOMING")
# Controlwords.
ENABLE, START, RELATIVE, HALT = 0x0F, 0x1F, 0x5F, 0x10F
# Bits of the statusword. In profile position mode bit 12 acknowledges a set-point.
REACHED, LIMIT, ACKNOWLEDGED, MOVES = 1 << 10, 1 << 11, 1 << 12, 1 << 14


def world(bus, field):
    """What the world knows of the module."""
    return bus.simulator.control("state")[field]


def enter(bus, node, state):
    """Has the library lead the drive to a state, and looks at the bridges."""
    node.state = state
    equal("state", node.state, state)
    equal(f"bridges in {state}", world(bus, "bridges_on"), state in ("OPERATION ENABLED", "QUICK STOP ACTIVE"))


def mode(node, name):
    """Has the library change the mode. The RPDO in which it does so has a controlword, too."""
    node.op_mode = name
    equal("mode", node.op_mode, name)


def until(what, node, bits, value):
    """Waits until these bits of the statusword are `value`."""
    wait_for(what, lambda: node.check_statusword() & bits == value)


def go(node, target, word=START):
    """Gives a set-point, with its handshake."""
    node.sdo[0x607A].raw = target
    node.controlword = word
    until("the set-point is acknowledged", node, ACKNOWLEDGED, ACKNOWLEDGED)
    node.controlword = ENABLE
    until("ready for the next set-point", node, ACKNOWLEDGED, 0)


def arrives(bus, node, position, zero):
    """Waits for the end of a move, and looks where the motor, its encoder and its rotor are."""
    until("the target is reached", node, REACHED, REACHED)
    equal("position", node.sdo[0x6064].raw, position)
    equal("rotor", world(bus, "rotor"), zero + position)


def speed(bus):
    """The speed of the rotor in internal units, over a fifth of a second of its own time."""
    before = bus.simulator.control("state")
    bus.simulator.let_pass(0.2)
    after = bus.simulator.control("state")
    return (after["rotor"] - before["rotor"]) * 1e6 / (after["time_us"] - before["time_us"]) / UNIT


def setting_up(bus, node):
    """The library finds its way about the PDOs."""
    reboot(node, "RESET")
    for communication in (0x1800, 0x1801):
        # The library takes a TPDO that has come twice for a cyclic one, and then waits for it.
        node.sdo[communication][5].raw = 50
    node.setup_402_state_machine()
    for what, found, index in (
        ("controlword", node.rpdo_pointers, 0x6040), ("mode", node.rpdo_pointers, 0x6060),
        ("statusword", node.tpdo_values, 0x6041), ("mode display", node.tpdo_values, 0x6061),
    ):
        check(f"{what} is in a PDO", index in found)
    node.nmt.state = "OPERATIONAL"
    until("there is a supply, and the node is operational", node, 0x210, 0x210)
    equal("state", node.state, "SWITCH ON DISABLED")
    equal("modes that the library finds", [name for name in MODES if not node.is_op_mode_supported(name)], [])


def states(bus, node):
    """All states that can be commanded, and all ways between them that the library knows."""
    node.sdo[0x605A].raw = 6
    uncommanded = ("START", "NOT READY TO SWITCH ON", "FAULT", "FAULT REACTION ACTIVE")
    ways = [way for way in State402.TRANSITIONTABLE if way[0] not in uncommanded]
    equal("number of ways", len(ways), 12)
    for start, end in ways:
        enter(bus, node, "SWITCH ON DISABLED")
        enter(bus, node, start)
        enter(bus, node, end)
    enter(bus, node, "SWITCH ON DISABLED")
    equal("no emergency", node.emcy.log, [])


def modes(bus, node):
    """All modes, in SWITCH ON DISABLED and in OPERATION ENABLED."""
    for name in MODES + MODES[::-1]:
        mode(node, name)
        equal("the library's RPDO has controlword 0", node.state, "SWITCH ON DISABLED")
    node.rpdo[2]["Controlword"].raw = ENABLE
    enter(bus, node, "OPERATION ENABLED")
    for name in MODES + MODES[::-1]:
        mode(node, name)
        equal("state", node.state, "OPERATION ENABLED")
    equal("nothing moves", (world(bus, "rotor"), node.emcy.log), (0, []))


def homing(bus, node):
    """Homing by a switch, at the edges of another one, where the motor stands, and by a switch that is not in use."""
    check("not homed yet", not node.is_homed())
    for sub, value in ((1, 2000), (2, 200)):
        node.sdo[0x6099][sub].raw = value
    for method, place, within, offset in (
        (19, HOME[0], POLLED, 0), (21, HOME[1], POLLED, -1234), (17, LEFT, LATCHED, 5678), (17, LEFT, LATCHED, 0)
    ):
        node.sdo[0x6098].raw = method
        node.sdo[0x607C].raw = offset
        equal(f"homing {method}", (node.homing(), node.is_homed()), (True, True))
        found = world(bus, "rotor")
        check(f"where homing {method} ends", abs(found - place) <= within, found)
        equal(f"position after homing {method}", node.sdo[0x6064].raw, -offset)
    equal("homed is homed in other modes", (node.op_mode, node.is_homed(restore_op_mode=True)), ("HOMING", True))
    mode(node, "PROFILED POSITION")
    equal("the library looks and changes the mode back", node.is_homed(restore_op_mode=True), True)
    equal("mode", node.op_mode, "PROFILED POSITION")
    equal("no emergency", node.emcy.log, [])

    # The left limit switch, which method 17 needs, is switched off.
    enter(bus, node, "SWITCH ON DISABLED")
    node.sdo[0x2005].raw = 1
    equal("homing by a switch that is off", node.homing(restore_op_mode=True), False)
    emergency("homing by a switch that is off", node, 0x6320, 0x21, 0, 255)
    equal("nothing has moved", world(bus, "rotor"), found)
    check("not homed", not node.is_homed(restore_op_mode=True))
    enter(bus, node, "SWITCH ON DISABLED")
    node.sdo[0x2005].raw = 0

    enter(bus, node, "OPERATION ENABLED")
    go(node, 10_000)
    arrives(bus, node, 10_000, found)
    node.sdo[0x6098].raw = 35
    equal("homing 35", (node.homing(), node.is_homed(restore_op_mode=True)), (True, True))
    equal("zero is where the motor stands", (node.sdo[0x6064].raw, world(bus, "rotor")), (0, found + 10_000))
    equal("no emergency", node.emcy.log, [])


def position(bus, node):
    """Profile position mode: far, and back; relative; halt; a target that is refused."""
    node.sdo[0x6081].raw = 2000
    mode(node, "PROFILED POSITION")
    enter(bus, node, "OPERATION ENABLED")
    zero = world(bus, "rotor") - node.sdo[0x6064].raw
    for target in (FAR, 0):
        go(node, target)
        until("the motor moves", node, MOVES, MOVES)
        arrives(bus, node, target, zero)
    for target in (3_000, 6_000):
        go(node, 3_000, RELATIVE)
        arrives(bus, node, target, zero)
    go(node, FAR)
    until("the motor moves", node, MOVES, MOVES)
    node.controlword = HALT
    until("a halt", node, REACHED | MOVES, REACHED)
    check("it halts on its way", 6_000 <= node.sdo[0x6064].raw < FAR)
    node.controlword = ENABLE
    until("the motor goes on", node, MOVES, MOVES)
    go(node, 100_000)
    arrives(bus, node, 100_000, zero)
    equal("no emergency", node.emcy.log, [])
    node.sdo[0x607D][2].raw = 100_000
    node.sdo[0x607A].raw = 100_001
    node.controlword = START
    emergency("a target outside the limits", node, 0x6320, 0x21, 0, 255)
    arrives(bus, node, 100_000, zero)
    node.sdo[0x607D][2].raw = 0x7FFFFFFF
    node.controlword = ENABLE
    # From where there is much room on either side.
    go(node, 200_000)
    arrives(bus, node, 200_000, zero)


def velocities(bus, node):
    """Velocity and profile velocity mode; halt, a limit switch, quick stop."""
    node.rpdo[2]["Controlword"].raw = ENABLE
    for name, target in (("VELOCITY", 0x6042), ("PROFILED VELOCITY", 0x60FF)):
        mode(node, name)
        enter(bus, node, "OPERATION ENABLED")
        for value in (500, -500):
            node.sdo[target].raw = value
            until("the target velocity is reached", node, REACHED | MOVES, REACHED | MOVES)
            equal("velocity", node.sdo[0x606C].raw, value)
            found = speed(bus)
            check("speed of the rotor", abs(found - value) <= 5, found)
            node.controlword = HALT
            until("a halt", node, REACHED | MOVES, REACHED)
            equal("it stands", speed(bus), 0)
            node.controlword = ENABLE
            until("it goes on", node, REACHED | MOVES, REACHED | MOVES)
        node.sdo[target].raw = 0
        until("a stop", node, REACHED | MOVES, REACHED)

    equal("no emergency", node.emcy.log, [])
    node.sdo[0x60FF].raw = 500
    until("it turns", node, MOVES, MOVES)
    bus.simulator.control("press right")
    until("a limit switch", node, LIMIT | MOVES, LIMIT)
    emergency("a limit switch", node, 0xFF01, 0xA1, 3, 0)
    equal("state at a limit switch", node.state, "OPERATION ENABLED")
    node.sdo[0x60FF].raw = -500
    until("it turns back", node, MOVES, MOVES)
    bus.simulator.control("release right")
    until("off the limit switch", node, LIMIT, 0)

    enter(bus, node, "QUICK STOP ACTIVE")
    until("a quick stop", node, REACHED | MOVES, REACHED)
    equal("it stands, with current", (speed(bus), world(bus, "bridges_on")), (0, True))
    enter(bus, node, "OPERATION ENABLED")
    until("it turns again", node, MOVES, MOVES)
    node.sdo[0x60FF].raw = 0
    until("a stop", node, MOVES, 0)
    enter(bus, node, "SWITCH ON DISABLED")


def faults(bus, node):
    """FAULT, and how the library resets it; FAULT REACTION ACTIVE."""
    mode(node, "PROFILED VELOCITY")
    enter(bus, node, "OPERATION ENABLED")
    node.sdo[0x60FF].raw = 500
    until("it turns", node, MOVES, MOVES)
    bus.simulator.control("supply 7")
    wait_for("FAULT", node.is_faulted)
    emergency("under-voltage", node, 0xFF00, 0x25, 0, 0)
    equal("bridges in FAULT", world(bus, "bridges_on"), False)
    # The cause is still there.
    node.controlword = 0x80
    bus.simulator.let_pass(0.1)
    equal("FAULT stays", node.check_statusword() & 0x6F, 0x08)
    node.controlword = 0x00
    bus.simulator.control("supply 24")
    bus.simulator.let_pass(0.1)
    node.reset_from_fault()
    equal("state after the reset", node.state, "OPERATION ENABLED")
    emergency("fault reset", node, 0x0000, 0, 0, 0)
    until("the target velocity is in force again", node, MOVES, MOVES)

    enter(bus, node, "SWITCH ON DISABLED")
    bus.simulator.control("input 0 1")
    bus.simulator.let_pass(0.01)
    node.sdo[0x2005].raw = 0x40
    node.sdo[0x6085].raw = 10
    enter(bus, node, "OPERATION ENABLED")
    until("it turns", node, REACHED | MOVES, REACHED | MOVES)
    bus.simulator.control("input 0 0")
    wait_for("FAULT REACTION ACTIVE", lambda: node.state == "FAULT REACTION ACTIVE")
    emergency("shutdown", node, 0x5441, 0x21, 0, 255)
    wait_for("FAULT", node.is_faulted)
    bus.simulator.control("input 0 1")
    bus.simulator.let_pass(0.1)
    node.reset_from_fault()
    equal("state after the reset", node.state, "OPERATION ENABLED")
    enter(bus, node, "SWITCH ON DISABLED")


def master_lost(bus, node):
    """A master that was silent and is heard again: the library resets the fault."""
    node.sdo[0x1029][1].raw = 1
    node.sdo[0x60FF].raw = 0
    # Node 100, a minute: the computer may be slow. The module's own minute goes faster.
    node.sdo[0x1016][1].raw = 100 << 16 | 60_000
    enter(bus, node, "OPERATION ENABLED")
    bus.network.send_message(0x764, [5])
    bus.simulator.control("pause")
    bus.simulator.control("step 61 s")
    bus.simulator.control("resume")
    wait_for("FAULT", node.is_faulted)
    emergency("heartbeat lost", node, 0x8130, 0x11, 0, 255)
    bus.network.send_message(0x764, [5])
    node.reset_from_fault()
    equal("state after the reset", node.state, "OPERATION ENABLED")
    emergency("fault reset", node, 0x0000, 0, 0, 0)
    node.sdo[0x1016][1].raw = 0
    enter(bus, node, "SWITCH ON DISABLED")


def following_error(bus, node):
    """A following error, which only a board with an encoder has: the library resets the fault."""
    try:
        node.sdo[0x6065].raw = 2_000
    except SdoAbortedError:
        return
    enter(bus, node, "OPERATION ENABLED")
    bus.simulator.control("slip 12")
    wait_for("FAULT", node.is_faulted)
    emergency("following error", node, 0x8611, 0x21, 0, 0)
    node.reset_from_fault()
    equal("state after the reset", node.state, "OPERATION ENABLED")
    emergency("fault reset", node, 0x0000, 0, 0, 0)
    equal("the following error", node.sdo[0x60F4].raw, 0)
    enter(bus, node, "SWITCH ON DISABLED")


def lost_page(options, folder):
    """A page of the settings that is gone: the library cannot reset that fault before the list of objects is downloaded."""
    eeprom = Path(folder) / "module.eeprom"
    links = ("--firmware", "canopen", "--slcan-tcp", "127.0.0.1:0", "--eeprom", str(eeprom))

    def start():
        simulator = Simulator(options.binary, *links, image=options.image)
        bus = Bus(simulator)
        node = bus.node(1, BaseNode402)
        reboot(node, "RESET")
        for communication in (0x1800, 0x1801):
            node.sdo[communication][5].raw = 50
        node.setup_402_state_machine()
        node.nmt.state = "OPERATIONAL"
        return simulator, bus, node

    simulator, bus, node = start()
    node.sdo[0x2003].raw = 40
    node.sdo[0x1010][1].raw = int.from_bytes(b"save", "little")
    simulator.let_pass(0.2)
    bus.network.disconnect()
    simulator.end()
    contents = bytearray(eeprom.read_bytes())
    # Both copies of the sixth page of the settings: objects from 2000h on.
    for copy in (10, 11):
        contents[-2048 + 64 * copy + 20] ^= 1
    eeprom.write_bytes(contents)

    simulator, bus, node = start()
    wait_for("FAULT", lambda: node.check_statusword() & 0x6F == 0x08)
    equal("error code", node.sdo[0x603F].raw, 0x6310)
    BaseNode402.TIMEOUT_SWITCH_STATE_FINAL = BaseNode402.TIMEOUT_SWITCH_STATE_SINGLE = 1
    try:
        node.reset_from_fault()
        check("the fault stays", False, node.state)
    except RuntimeError:
        equal("the fault stays", node.state, "FAULT")
    BaseNode402.TIMEOUT_SWITCH_STATE_FINAL = BaseNode402.TIMEOUT_SWITCH_STATE_SINGLE = PATIENCE
    node.controlword = 0
    for index in range(0x2000, 0x20B0):
        known = node.object_dictionary.get(index)
        for entry in getattr(known, "subindices", {0: known}) if known else ():
            variable = node.sdo[index][entry] if hasattr(known, "subindices") else node.sdo[index]
            if variable.od.writable:
                # Those that are not lost may be refused in FAULT.
                with contextlib.suppress(SdoAbortedError):
                    variable.raw = 40 if index == 0x2003 else variable.raw
    node.reset_from_fault()
    equal("state after the list was downloaded", node.state, "OPERATION ENABLED")
    node.state = "SWITCH ON DISABLED"
    bus.network.disconnect()
    simulator.end()


class Warnings(logging.Handler):
    """What the library has warned of. It does not raise when a mode does not change in time."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.heard = []

    def emit(self, record):
        self.heard.append(record.getMessage())


def main():
    options = command_line("Drives the motor of a virtual module with the CANopen firmware by python-canopen.")
    warnings = Warnings()
    logging.getLogger("canopen.profiles").addHandler(warnings)
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder) / "stage.toml"
        stage.write_text(STAGE)
        links = ("--firmware", "canopen", "--slcan-tcp", "127.0.0.1:0", "--world", str(stage))
        simulator = Simulator(options.binary, *links, image=options.image)
        try:
            bus = Bus(simulator)
            node = bus.node(1, BaseNode402)
            for part in (setting_up, states, modes, homing, position, velocities, faults, master_lost, following_error):
                print(f"{part.__doc__}", flush=True)
                try:
                    part(bus, node)
                except Exception as error:  # One part that fails shall not hide the others.
                    check(part.__name__, False, repr(error))
            equal("warnings of the library", warnings.heard, [])
            bus.network.disconnect()
        finally:
            simulator.end()
        print(f"{lost_page.__doc__}", flush=True)
        lost_page(options, folder)
    conclude()


if __name__ == "__main__":
    main()
