#!/usr/bin/env python3
"""Drives virtual modules with the CANopen firmware by python-canopen, dcf-tools and eds-utils, all unmodified.

    python3 tests/clients/canopen_client.py target/debug/tmcl [--image target/thumbv7em-none-eabi/release/tmcm1140-canopen]

Starts `tmcl sim --firmware canopen` itself. Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import canopen
from canopen.objectdictionary import datatypes
from canopen.sdo import SdoAbortedError
from canopen_bus import EDS, Bus, aborts, emergency, reboot
from virtual_module import PATIENCE, Simulator, check, command_line, conclude, equal, wait_for

MODULES = (1, 2, 3)
MASTER = 127
NAMED = {"save": 0x65766173, "load": 0x64616F6C, "make": 0x656B616D, "kill": 0x6C6C696B}
# Sizes of the types in bytes.
SIZES = {
    datatypes.UNSIGNED8: 1, datatypes.UNSIGNED16: 2, datatypes.UNSIGNED32: 4, datatypes.UNSIGNED64: 8,
    datatypes.INTEGER8: 1, datatypes.INTEGER16: 2, datatypes.INTEGER32: 4, datatypes.OCTET_STRING: 7,
}
# What an object reads that the EDS has no default for; anything where it is None.
LIVE = {
    (0x1023, 1): bytes(7), (0x1023, 3): bytes(7), (0x2707, 0): 1000, (0x270E, 1): None, (0x6041, 0): 0x0050,
    (0x6062, 0): 0, (0x6063, 0): 0, (0x6064, 0): 0, (0x606C, 0): 0, (0x60F4, 0): 0,
}


def power_cycle(bus, number):
    """Switches a module off and on again."""
    heard = bus.listen(0x700 + number)
    bus.simulator.control(f"module {MODULES.index(number) + 1} power off")
    bus.simulator.control(f"module {MODULES.index(number) + 1} power on")
    wait_for(f"boot-up of node {number}", lambda: bytes([0]) in heard)


def reset_fault(node):
    """The drive of the node is in FAULT, whose cause is gone, and a fault reset ends that."""
    node.emcy.reset()
    equal("FAULT", node.sdo[0x6041].raw & 0x6F, 0x08)
    for word in (0x00, 0x80):
        node.sdo[0x6040].raw = word
    emergency("fault reset", node, 0x0000, 0, 0, 0)
    equal("SWITCH ON DISABLED", node.sdo[0x6041].raw & 0x6F, 0x40)


def scan(bus):
    """Who is there."""
    network = bus.network
    network.scanner.search()
    wait_for("all nodes are found", lambda: set(MODULES) <= set(network.scanner.nodes))
    bus.simulator.let_pass(0.1)
    equal("no other node is found", sorted(network.scanner.nodes), list(MODULES))


def objects(node):
    """Every object of the EDS, and some that are not there."""
    count = 0
    for entry in node.object_dictionary.values():
        for variable in entry.values() if hasattr(entry, "values") else [entry]:
            place = (variable.index, variable.subindex)
            what = f"{variable.index:04X}h.{variable.subindex} {variable.name}"
            data = node.sdo.upload(*place)
            if variable.data_type in SIZES:
                equal(f"length of {what}", len(data), SIZES[variable.data_type])
            expected = LIVE.get(place, node.id if variable.index in (0x2705, 0x2708) else variable.default)
            check(f"{what} has a default", expected is not None or place in LIVE)
            if expected is not None:
                equal(what, variable.decode_raw(data), expected)
            count += 1
    equal("number of objects", count, 211)
    aborts("1018h.4", 0x06090011, node.sdo.upload, 0x1018, 4)
    aborts("1020h", 0x06020000, node.sdo.upload, 0x1020, 1)


def writing(node):
    """Expedited and segmented transfers, and what is refused."""
    sdo = node.sdo
    for segmented in (False, True):
        for index, subindex, form, value in (
            (0x2003, 0, "<B", 77), (0x209E, 0, "<b", -63), (0x1017, 0, "<H", 0), (0x605A, 0, "<h", 6),
            (0x607A, 0, "<i", -123456), (0x6083, 0, "<I", 500), (0x607D, 1, "<i", -70000),
        ):
            what = f"{index:04X}h.{subindex}, {'segmented' if segmented else 'expedited'}"
            before = sdo.upload(index, subindex)
            sdo.download(index, subindex, struct.pack(form, value), force_segment=segmented)
            equal(what, sdo.upload(index, subindex), struct.pack(form, value))
            sdo.download(index, subindex, before, force_segment=segmented)
            equal(f"{what}, as before", sdo.upload(index, subindex), before)
    for what, code, index, subindex, data in (
        ("read-only", 0x06010002, 0x1000, 0, bytes(4)), ("no object", 0x06020000, 0x6004, 0, bytes(4)),
        ("no sub-index", 0x06090011, 0x1010, 3, b"save"), ("too short", 0x06070013, 0x6083, 0, bytes(2)),
        ("too long", 0x06070012, 0x2003, 0, bytes(2)), ("segmented, too long", 0x06070012, 0x6083, 0, bytes(20)),
        ("too low", 0x06090032, 0x209E, 0, b"\xC0"), ("too high", 0x06090031, 0x209E, 0, b"\x40"),
        ("in a gap", 0x06090030, 0x2097, 0, b"\x01"), ("wrong signature", 0x08000020, 0x1010, 1, b"SAVE"),
        ("mapping while valid", 0x06010000, 0x1600, 0, b"\0"),
        ("COB-ID while valid", 0x06010000, 0x1400, 1, struct.pack("<I", 0x205 + node.id)),
        ("no TMCL mode", 0x08000022, 0x1023, 1, bytes(7)),
    ):
        aborts(what, code, sdo.download, index, subindex, data)
    aborts("block transfer", 0x05040001, sdo.open, 0x1008, mode="rb", block_transfer=True)
    equal("the name, in segments", sdo[0x1008].raw, "TMCM-1140")


def states(bus, node):
    """Network management and the heartbeat of the node."""
    reboot(node, "RESET COMMUNICATION")
    reboot(node, "RESET")
    node.sdo[0x1017].raw = 20
    for state in ("OPERATIONAL", "STOPPED", "PRE-OPERATIONAL", "OPERATIONAL"):
        node.nmt.state = state
        bus.simulator.let_pass(0.1)
        node.nmt.wait_for_heartbeat(PATIENCE)
        equal("state by heartbeat", node.nmt.wait_for_heartbeat(PATIENCE), state)
    node.sdo[0x1017].raw = 0


def emergencies(bus, node):
    """Emergency messages, and the error register."""
    node.nmt.state = "OPERATIONAL"
    node.emcy.reset()
    rpdo2 = 0x300 + node.id
    bus.network.send_message(rpdo2, bytes(2))
    emergency("a PDO that is too short", node, 0x8210, 0x11, 0, 255)
    bus.network.send_message(rpdo2, bytes(4))
    emergency("a PDO that is too long", node, 0x8220, 0x11, 0, 255)
    bus.network.send_message(rpdo2, bytes([0, 0, 99]))
    emergency("a mode that is refused", node, 0x6320, 0x31, 0, 255)
    equal("error register", node.sdo[0x1001].raw, 0x31)
    number = MODULES.index(node.id) + 1
    # The controller of a flash image gets there by what it wants to send; nobody hears it before it is back.
    node.sdo[0x1017].raw = 20
    # Whether it is found to be error passive on its way to bus-off depends on when the firmware looks.
    # When it is error passive no more that is told as well. A node that is off the bus goes on then, and is not stopped.
    node.sdo[0x1029][1].raw = 1
    for state, what, code, on_the_way in (
        ("passive", "error passive", 0x8120, (0x0000,)),
        ("off", "bus-off is over", 0x8140, (0x8120, 0x0000)),
    ):
        bus.simulator.control(f"module {number} can {state}")
        bus.simulator.let_pass(0.1)
        bus.simulator.control(f"module {number} can on")
        emergency(what, node, code, 0x31, 0, 255, on_the_way=on_the_way)
    reboot(node, "RESET COMMUNICATION")
    equal("error register after a reset", node.sdo[0x1001].raw, 0)
    reset_fault(node)


def watched_by_heartbeat(bus, node):
    """The node watches the heartbeat of the master."""
    node.sdo[0x1016][1].raw = MASTER << 16 | 3000
    node.nmt.state = "OPERATIONAL"
    node.emcy.reset()
    heartbeat = bus.network.send_periodic(0x700 + MASTER, [5], 0.05)
    bus.simulator.let_pass(3.5)
    equal("no emergency while the heartbeat is there", node.emcy.log, [])
    heartbeat.stop()
    emergency("the master's heartbeat is lost", node, 0x8130, 0x11, 0, 255)
    replies = bus.listen(0x580 + node.id)
    bus.network.send_message(0x600 + node.id, bytes([0x40, 0x01, 0x10, 0, 0, 0, 0, 0]))
    bus.simulator.let_pass(0.1)
    equal("a stopped node answers no SDO", replies, [])
    reboot(node, "RESET COMMUNICATION")
    reset_fault(node)


def watched_by_guarding(bus, node):
    """The master guards the node, and the node watches that it does."""
    answers = bus.listen(0x700 + node.id)
    node.sdo[0x100C].raw = 1000
    node.sdo[0x100D].raw = 3
    node.nmt.state = "OPERATIONAL"
    node.emcy.reset()
    node.nmt.start_node_guarding(0.05)
    wait_for("answers to guarding", lambda: len(answers) >= 6)
    node.nmt.stop_node_guarding()
    toggles = [answer[0] for answer in answers]
    equal("state and toggle bit", toggles, [0x05 | 0x80 * (turn % 2) for turn in range(len(toggles))])
    emergency("guarding is lost", node, 0x8130, 0x11, 0, 255)
    reboot(node, "RESET COMMUNICATION")
    reset_fault(node)


def pdos(bus, node):
    """PDOs as they are, and remapped; SYNC."""
    bus.network.sync.cob_id = 0x80
    for pdo in (node.tpdo, node.rpdo):
        pdo.read()
    equal("TPDO3", [variable.index for variable in node.tpdo[3].map], [0x6041, 0x6064])
    node.tpdo[1].clear()
    for index, subindex in ((0x6041, 0), (0x6061, 0), (0x606C, 0)):
        node.tpdo[1].add_variable(index, subindex)
    node.tpdo[1].trans_type = 1
    node.tpdo[1].enabled = True
    node.tpdo[1].save()
    node.rpdo[2].clear()
    for index, subindex in ((0x607A, 0), (0x2703, 1)):
        node.rpdo[2].add_variable(index, subindex)
    node.rpdo[2].trans_type = 0
    node.rpdo[2].enabled = True
    node.rpdo[2].save()
    equal("COB-ID of TPDO1", node.sdo[0x1800][1].raw, 0x40000180 + node.id)
    equal("mapping of RPDO2", [node.sdo[0x1601][sub].raw for sub in range(3)], [2, 0x607A0020, 0x27030120])

    events = bus.listen(0x280 + node.id)
    node.nmt.state = "OPERATIONAL"
    wait_for("TPDO2 on entering operational", lambda: events)
    equal("TPDO2", events[0], bytes([0x50, 0x02, 0]))
    received = node.tpdo[1].wait_for_reception(0.2)
    check("TPDO1 waits for the SYNC", received is None)
    heard = bus.listen(0x180 + node.id)
    for turn in range(1, 6):
        bus.network.sync.transmit()
        wait_for("TPDO1 with the SYNC", lambda: len(heard) == turn)
    equal("TPDO1", (heard[-1], node.tpdo[1]["Statusword"].raw), (bytes([0x50, 0x02, 0, 0, 0, 0, 0]), 0x0250))

    node.rpdo[2]["Target position"].raw = -4711
    node.rpdo[2].transmit()
    equal("a synchronous RPDO waits for the SYNC", node.sdo[0x607A].raw, 0)
    bus.network.sync.transmit()
    equal("a synchronous RPDO acts after the SYNC", node.sdo[0x607A].raw, -4711)
    before = len(events)
    node.rpdo[1]["Controlword"].raw = 6
    node.rpdo[1].transmit()
    equal("an RPDO acts at once", node.sdo[0x6040].raw, 6)
    equal("TPDO2 with READY TO SWITCH ON", events[before:], [bytes([0x31, 0x02, 0])])
    before = len(events)
    bus.simulator.let_pass(0.05)
    equal("TPDO2 while nothing changes", len(events), before)
    node.sdo[0x6060].raw = 3
    wait_for("TPDO2 after a change", lambda: len(events) > before)
    equal("TPDO2 with the mode", events[-1], bytes([0x31, 0x02, 3]))
    node.sdo[0x1801][5].raw = 20
    wait_for("TPDO2 by its event timer", lambda: len(events) >= before + 6)
    reboot(node, "RESET COMMUNICATION")
    node.sdo[0x6060].raw = 0
    equal("mapping after a reset", node.sdo[0x1601][1].raw, 0x60400010)


def saving(bus, node):
    """What is saved is there after a power cycle, what is not is gone. Restoring all makes it node 1, which it is."""
    node.sdo[0x2003].raw = 99
    node.store(4)
    node.sdo[0x2004].raw = 55
    node.sdo[0x1017].raw = 500
    power_cycle(bus, node.id)
    equal("saved with the motor, or not", [node.sdo[index].raw for index in (0x2003, 0x2004, 0x1017)], [99, 8, 0])
    node.sdo[0x1017].raw = 500
    node.store(1)
    power_cycle(bus, node.id)
    equal("saved with all", [node.sdo[index].raw for index in (0x2003, 0x1017)], [99, 500])
    node.restore(1)
    equal("restored after the next reset only", node.sdo[0x2003].raw, 99)
    reboot(node, "RESET")
    equal("restored", [node.sdo[index].raw for index in (0x2003, 0x1017)], [128, 0])


def another_node_id(bus, node):
    """The node ID and the bit rate of a node are changed, and changed back."""
    node.sdo[0x2705].raw = 42
    node.sdo[0x2704].raw = 250
    equal("in force is what was", [node.sdo[index].raw for index in (0x2707, 0x2708)], [1000, node.id])
    node.sdo[0x2706][1].raw = NAMED["save"]
    heard = bus.listen(0x700 + 42)
    node.nmt.state = "RESET"
    wait_for("boot-up with the other node ID", lambda: bytes([0]) in heard)
    other = bus.node(42)
    equal("in force is what is saved", [other.sdo[index].raw for index in (0x2707, 0x2708)], [250, 42])
    found = [other.sdo[0x1014].raw, other.sdo[0x1403][1].raw, other.sdo[0x1800][1].raw]
    equal("identifiers follow the node ID", found, [0x80 + 42, 0x40000500 + 42, 0x40000180 + 42])
    other.sdo[0x2705].raw = node.id
    other.sdo[0x2704].raw = 1000
    other.store(2)
    heard = bus.listen(0x700 + node.id)
    other.nmt.state = "RESET"
    wait_for("boot-up with the first node ID", lambda: bytes([0]) in heard)
    equal("in force again", [node.sdo[index].raw for index in (0x2707, 0x2708)], [1000, node.id])


PDOS = """
master:
  node_id: {master}
  heartbeat_producer: 1000
axis:
  dcf: {eds}
  node_id: {node}
  heartbeat_consumer: true
  heartbeat_producer: 100
  rpdo:
    2:
      cob_id: auto
      transmission: 1
      mapping: [{{index: 0x6040}}, {{index: 0x6060}}, {{index: 0x60FF}}]
    4:
      cob_id: auto
      mapping: [{{index: 0x6042}}, {{index: 0x2703, sub_index: 1}}]
  tpdo:
    1:
      cob_id: auto
      transmission: 0xFF
      event_timer: 50
      mapping: [{{index: 0x6041}}, {{index: 0x6061}}, {{index: 0x606C}}]
    3:
      cob_id: auto
      transmission: 1
      mapping: [{{index: 0x6064}}, {{index: 0x60FD}}]
  sdo:
    - {{index: 0x6083, value: 500}}
"""


def tool(name, *arguments):
    """Runs one of dcf-tools; they stand beside the interpreter."""
    command = [Path(sys.executable).with_name(name), *arguments]
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=PATIENCE)


def written(file):
    """The writes in a file of dcfgen: index, sub-index, data."""
    data = file.read_bytes()
    (count,), at = struct.unpack_from("<I", data), 4
    for _ in range(count):
        index, subindex, length = struct.unpack_from("<HBI", data, at)
        at += 7
        yield index, subindex, data[at:at + length]
        at += length


def configuration(binary, bus, node):
    """dcf-tools find the EDS right, and the node takes what they make of it for a Lely master."""
    checked = tool("dcfchk", "-n", "5", EDS)
    equal("dcfchk has nothing to say", (checked.returncode, checked.stdout, checked.stderr), (0, "", ""))
    checked = tool("eds-validate", EDS)
    # It reads all, but does not know this key of CiA 306, which keeps masters from writing commands such as 1011h.
    strange = [line for line in (checked.stdout + checked.stderr).splitlines() if 'entry "ObjFlags"' not in line]
    equal("eds-validate has nothing else to say", strange, [])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "axis.dcf"
        equal("tmcl eds", subprocess.run([binary, "eds", "--node-id", "7", "-o", file]).returncode, 0)
        checked = tool("dcfchk", file)
        equal("dcfchk on the file of a node", (checked.returncode, checked.stdout, checked.stderr), (0, "", ""))
        imported = canopen.import_od(str(file))
        equal("the file of a node", (imported.node_id, imported[0x1400][1].default), (7, 0x40000207))

        plan = Path(folder) / "bus.yml"
        plan.write_text(PDOS.format(master=MASTER, eds=EDS, node=node.id))
        made = tool("dcfgen", "-r", "-d", folder, plan)
        equal("dcfgen", (made.returncode, made.stdout), (0, ""))
        check("dcfgen makes a master", (Path(folder) / "master.dcf").stat().st_size > 0)
        writes = list(written(Path(folder) / "axis.bin"))
    equal("number of writes", len(writes), 31)
    for index, subindex, data in writes:
        try:
            node.sdo.download(index, subindex, data)
            check("a write of dcfgen", True)
        except SdoAbortedError as abort:
            check(f"a write of dcfgen: {index:04X}h.{subindex} = {data.hex()}", False, abort)
    equal("bit 30 reads 1", node.sdo[0x1401][1].raw, 0x40000300 + node.id)

    own, states = bus.listen(0x180 + node.id), []
    node.nmt.add_heartbeat_callback(states.append)
    node.emcy.reset()
    heartbeat = bus.network.send_periodic(0x700 + MASTER, [5], 0.1)
    node.nmt.state = "OPERATIONAL"
    wait_for("heartbeats and TPDO1 come by themselves", lambda: states.count(5) >= 3 and len(own) >= 3)
    equal("length of TPDO1", len(own[0]), 7)
    bus.network.send_message(0x300 + node.id, struct.pack("<HBi", 0, 3, -250))
    equal("RPDO2 waits for the SYNC", node.sdo[0x60FF].raw, 0)
    bus.network.sync.transmit()
    equal("RPDO2 acts after the SYNC", (node.sdo[0x60FF].raw, node.sdo[0x6060].raw), (-250, 3))
    bus.network.send_message(0x500 + node.id, struct.pack("<hI", -99, 0))
    equal("RPDO4", node.sdo[0x6042].raw, -99)
    equal("no emergency", node.emcy.log, [])
    heartbeat.stop()
    emergency("the master's heartbeat is lost", node, 0x8130, 0x11, 0, 255)
    reboot(node, "RESET")


def main():
    options = command_line("Drives virtual modules with the CANopen firmware by python-canopen and dcf-tools.")
    links = ("--firmware", "canopen", "--modules", str(len(MODULES)), "--slcan-tcp", "127.0.0.1:0")
    simulator = Simulator(options.binary, *links, image=options.image)
    try:
        bus = Bus(simulator)
        node, last = bus.node(MODULES[0]), bus.node(MODULES[-1])
        for part, arguments in (
            (scan, (bus,)), (objects, (last,)), (writing, (node,)), (states, (bus, node)), (emergencies, (bus, node)),
            (watched_by_heartbeat, (bus, node)), (watched_by_guarding, (bus, node)), (pdos, (bus, node)),
            (saving, (bus, node)), (another_node_id, (bus, last)), (configuration, (options.binary, bus, node)),
        ):
            print(f"{part.__doc__}", flush=True)
            try:
                part(*arguments)
            except Exception as error:  # One part that fails shall not hide the others.
                check(part.__name__, False, repr(error))
        bus.network.disconnect()
    finally:
        simulator.end()
    conclude()


if __name__ == "__main__":
    main()
