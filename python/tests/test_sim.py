"""How a simulator is started, what it tells of itself, and its links."""

from __future__ import annotations

import os
from pathlib import Path

import can
import canopen
import pytest
import serial
from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM1140

from tmcl_sim import Sim, SimError, StartError

# GAP 6, 0 (the maximum current) to module 1, and what it answers: 128.
REQUEST = bytes([1, 6, 6, 0, 0, 0, 0, 0, 13])
REPLY = bytes([2, 1, 100, 6, 0, 0, 0, 128, 237])
# What Trinamic's CANopen nodes tell as their vendor.
VENDOR = 0x286
# A network management command: begin anew.
RESET_NODE = 129


def test_a_world(tmp_path: Path) -> None:
    world = tmp_path / "stage.toml"
    world.write_text("[motor]\nload = 0.5\n")
    with Sim(world) as sim:
        assert sim.load == 0.5
    with Sim(world=str(world)) as sim:
        assert sim.load == 0.5


def test_a_path_may_begin_with_a_dash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("-x.toml").write_text("[motor]\nload = 0.5\n")
    with Sim("-x.toml", eeprom="-x.bin") as sim:
        assert sim.load == 0.5
    assert Path("-x.bin").exists()


@pytest.mark.filterwarnings("error")
def test_a_path_that_can_be_none_is_refused() -> None:
    with pytest.raises(StartError, match="embedded null byte"):
        Sim("a\0b")


def test_an_eeprom_keeps_what_is_stored(tmp_path: Path) -> None:
    for stored in (128, 77):
        with Sim(eeprom=tmp_path / "module.bin") as sim:
            assert sim.send("GAP 6, 0").value == stored
            sim.send("SAP 6, 0, 77")
            sim.send("STAP 6, 0")


def test_what_it_tells_of_itself() -> None:
    with Sim(product="3212") as sim:
        assert repr(sim) == "<Sim 1: TMCM-3212>"
        assert (sim.ready["product"], sim.ready["firmware"], sim.ready["time"]) == ("TMCM-3212", "tmcl", "paused")
        assert sim.tcp == sim.ready["tcp"]
        assert sim.control("state")["ok"]


def test_telegrams() -> None:
    with Sim() as sim:
        assert sim.telegrams() == []
        sim.send("GAP 6, 0")
        sim.send("GAP 1, 0")
        lines = sim.telegrams()
        assert len(lines) == 4
        assert lines[0].endswith("01 06 06 00 00 00 00 00 0D   to 1: GAP 6, 0")
        assert sim.telegrams(last=1) == lines[-1:]
        assert sim.telegrams(last=0) == []
        assert sim.telegrams(last=100) == lines
        for _ in range(200):
            sim.send("GAP 6, 0")
        lines = sim.telegrams()
        assert len(lines) == 404
        assert [sim.telegrams(last=count) for count in (1, 300, 404)] == [lines[-1:], lines[-300:], lines]
        # However much of the file is read for the last ones, the first of them is whole: their lengths differ.
        for length in range(100):
            sim.send(f"SGP 0, 2, {10 ** (length % 9)}")
            lines = sim.telegrams()
            for count in (50, 51, 52, 53, 100):
                assert sim.telegrams(last=count) == lines[-count:]


def test_a_log_is_kept(tmp_path: Path) -> None:
    log = tmp_path / "telegrams.txt"
    log.write_text("of an earlier run\n")
    with Sim(log=log) as sim:
        sim.send("GAP 6, 0")
        lines = sim.telegrams()
    assert log.read_text().splitlines() == lines
    assert len(lines) == 2


def test_pytrinamic() -> None:
    with Sim() as sim, ConnectionManager(sim.pytrinamic).connect() as connection:
        TMCM1140(connection).motors[0].move_to(1000)
        sim.run_until("position = 1000", max=1.0)
        assert TMCM1140(connection).motors[0].actual_position == 1000


def test_serial_ports() -> None:
    with Sim(serial=True, rs485=True) as sim:
        for path in (sim.serial, sim.rs485):
            with serial.Serial(path, timeout=60) as port:
                port.write(REQUEST)
                assert port.read(9) == REPLY
        paths = [sim.serial, sim.rs485]
    assert not any(os.path.lexists(path) for path in paths)


def test_can() -> None:
    with Sim(modules=2, can=True) as sim, can.Bus(**sim.python_canopen) as bus:
        bus.send(can.Message(arbitration_id=1, data=REQUEST[1:8], is_extended_id=False))
        reply = bus.recv(60)
        assert reply is not None
        assert (reply.arbitration_id, bytes(reply.data)) == (2, REPLY[1:8])


def test_canopen() -> None:
    with Sim(firmware="canopen", modules=2) as sim:
        network = canopen.Network()
        network.connect(**sim.python_canopen)
        try:
            boots: list[int] = []
            network.subscribe(0x702, lambda identifier, data, time: boots.append(data[0]))
            node = network.add_node(canopen.RemoteNode(2, canopen.ObjectDictionary()))  # type: ignore[no-untyped-call]
            node.sdo.RESPONSE_TIMEOUT = 60
            node.nmt.send_command(RESET_NODE)
            sim.step(1.0)
            assert int.from_bytes(node.sdo.upload(0x1018, 1), "little") == VENDOR
            assert boots
        finally:
            network.disconnect()


def test_links_that_were_not_asked_for() -> None:
    with Sim() as sim:
        for link, argument in (("serial", "serial"), ("rs485", "rs485"), ("can", "can"), ("python_canopen", "can")):
            with pytest.raises(SimError, match=rf"^there is no .*: ask for one, as in Sim\({argument}=True\)$"):
                getattr(sim, link)


def test_close() -> None:
    sim = Sim(serial=True)
    watch = sim.watch(0.1, "rotor")
    sim.close()
    sim.close()
    for use in (sim.state, sim.telegrams, lambda: sim.send("GAP 6, 0"), watch.samples):
        with pytest.raises(SimError, match=r"^this Sim is closed$"):
            use()
    watch.close()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"world": "missing.toml"}, r"^tmcl: --world: cannot read missing.toml: there is no such file or folder$"),
        ({"product": "1141"}, r"'1141' is none of 1140, 1110, 3110, 3212, 6110; did you mean '1140'\?$"),
        ({"firmware": "canopen", "rs485": True}, r"--rs485: the CANopen firmware leaves the module's RS485 port off"),
        ({"log": "missing/log.txt"}, r"--log-telegrams: cannot write .*/missing/log.txt"),
        ({"binary": "/bin/true"}, r"^/bin/true has ended with exit code 0 before it was ready$"),
        ({"binary": "/missing/tmcl"}, r"^/missing/tmcl cannot be started: .*No such file"),
    ],
)
def test_a_start_that_fails_says_why(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(StartError, match=words):
        Sim(**arguments)  # type: ignore[arg-type]
