"""Nothing is left behind: no process, file, link, port, thread or file descriptor, however a simulator or its host
ends."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest

from tmcl_sim import Died, Sim, SimError, Watch

# How many simulators are started, and how many at a time.
STARTS, AT_A_TIME = int(os.environ.get("TMCL_SIM_STARTS", "100")), 8
# The longest that a busy computer may take, in seconds.
PATIENCE = 60


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for temporary files, which is empty."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    return tmp_path


def wait_until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it does not happen"
        time.sleep(0.01)


def is_running(pid: int) -> bool:
    """Whether there is such a process; one that has ended and that nobody has waited for does not run."""
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False


def is_open(address: str) -> bool:
    host, _, port = address.rpartition(":")
    try:
        socket.create_connection((host, int(port))).close()
    except ConnectionRefusedError:
        return False
    return True


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def test_starts_and_stops(folder: Path) -> None:
    def start(_: int) -> int:
        with Sim(serial=True, can=True) as sim:
            sim.send("MVP ABS, 0, 1000")
            with sim.watch(0.01, "rotor"):
                sim.step(0.1)
            return int(sim.ready["pid"])

    before = descriptors(), threading.active_count()
    with ThreadPoolExecutor(AT_A_TIME) as pool:
        processes = list(pool.map(start, range(STARTS)))
    assert len(set(processes)) == STARTS
    assert not any(Path(f"/proc/{pid}").exists() for pid in processes)
    assert os.listdir(folder) == []
    assert (descriptors(), threading.active_count()) == before


def test_a_simulator_that_nobody_closes(folder: Path) -> None:
    before = descriptors()
    sim = Sim(serial=True)
    pid = sim.ready["pid"]
    del sim
    assert not Path(f"/proc/{pid}").exists()
    assert os.listdir(folder) == []
    assert descriptors() == before


def test_a_start_that_fails(folder: Path) -> None:
    before = descriptors()
    with pytest.raises(SimError):
        Sim(world="missing.toml", serial=True)
    assert os.listdir(folder) == []
    assert descriptors() == before


def test_a_simulator_that_is_killed_while_somebody_waits(folder: Path) -> None:
    before = descriptors()
    sim = Sim(serial=True)
    # It says on standard error where the port is then.
    sim.usb(False, hangup=True)
    sim.usb(True)
    sim.send("GAP 6, 0")
    pid = sim.ready["pid"]
    # Nobody answers, until it is killed.
    os.kill(pid, signal.SIGSTOP)
    killer = threading.Timer(0.2, os.kill, (pid, signal.SIGKILL))
    killer.start()
    with pytest.raises(
        Died, match=r"(?s)^the simulator has ended with signal SIGKILL; its last lines:\n.*is .* again"
    ) as died:
        sim.step(1.0)
    killer.join()
    assert died.value.exit_code == -signal.SIGKILL
    assert died.value.last_lines.startswith("tmcl sim: the port of the USB link is ")
    with pytest.raises(Died):
        sim.state()
    assert len(sim.telegrams()) == 2
    sim.close()
    assert os.listdir(folder) == []
    assert descriptors() == before


def test_a_watch_of_a_simulator_that_dies() -> None:
    with Sim() as sim, sim.watch(0.1, "rotor") as watch:
        sim.step(0.1)
        os.kill(sim.ready["pid"], signal.SIGKILL)
        with pytest.raises(Died):
            watch.samples()
        watch.close()
        assert len(watch.rest()) == 1


@pytest.mark.filterwarnings("error")
def test_a_watch_leaves_nothing() -> None:
    with Sim() as sim:
        sim.state()
        before = descriptors(), threading.active_count()
        with pytest.raises(SimError):
            sim.watch(0.1, "roter")
        watch = sim.watch(0.1, "rotor")
        assert threading.active_count() > before[1]
        watch.close()
        watch.close()
        assert (descriptors(), threading.active_count()) == before
        watch = sim.watch(0.1, "rotor")
        del watch
        assert (descriptors(), threading.active_count()) == before
        watch = sim.watch(0.1, "rotor")
    assert threading.active_count() == before[1]
    with pytest.raises(SimError, match=r"^this Sim is closed$"):
        watch.samples()


def test_a_simulator_that_does_not_end_is_killed(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.setattr("tmcl_sim.process.PATIENCE", 0.1)
    sim = Sim(serial=True)
    os.kill(sim.ready["pid"], signal.SIGSTOP)
    sim.close()
    assert not Path(f"/proc/{sim.ready['pid']}").exists()
    assert os.listdir(folder) == []


class Interruption(Exception):
    pass


@contextmanager
def interruption() -> Iterator[None]:
    """An exception comes out of nowhere after some time, as that of Ctrl-C does."""

    def interrupt(*_: object) -> None:
        raise Interruption

    old = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.1)
    try:
        with pytest.raises(Interruption):
            yield
    finally:
        signal.signal(signal.SIGALRM, old)


def test_an_interruption_between_question_and_answer() -> None:
    with Sim() as sim:
        pid = sim.ready["pid"]
        try:
            os.kill(pid, signal.SIGSTOP)
            with interruption():
                sim.send("GAP 6, 0")
            with interruption():
                sim.send("GAP 6, 0")
        finally:
            os.kill(pid, signal.SIGCONT)
        # The answer to the question before is not taken for that to the next.
        assert sim.send("GAP 4, 0").value == 1000
        assert not sim.state().switches.left


def keep_busy(sim: Sim) -> None:
    """Modules run programs that never wait: an hour takes each of them some eight seconds."""
    for number in range(1, len(sim.ready["products"]) + 1):
        for line in ("132, 0, 0, 0", "JA 0", "133, 0, 0, 0", "129, 1, 0, 0"):
            sim.module(number).send(line)


def test_a_step_that_is_interrupted_ends() -> None:
    with Sim(modules=4) as sim, sim.watch(0.0001, "rotor", kept=1) as watch:
        keep_busy(sim)
        with interruption():
            sim.step(3600)
        now = sim.time
        assert now < 3600
        assert sim.step(0.1) == pytest.approx(now + 0.1)
        assert watch.samples()[0].time > now


@pytest.mark.parametrize("further", [lambda sim: sim.step(0.1), lambda sim: sim.pause(0.01), Sim.restart])
def test_what_follows_an_interrupted_step_is_not_refused(further: Callable[[Sim], object]) -> None:
    with Sim(modules=4) as sim:
        keep_busy(sim)
        with interruption():
            sim.step(3600)
        further(sim)
        assert sim.time < 3600


# A host at a terminal, which is sent Ctrl-C; it goes on, and so must its simulator.
HOST_OF_CTRL_C = """
import os, signal, sys
from tmcl_sim import Sim
with Sim() as sim:
    sim.send("ROR 0, 100")
    try:
        os.killpg(0, signal.SIGINT)
        signal.pause()
    except KeyboardInterrupt:
        sim.step(1.0)
        print(sim.send("GAP 3, 0").value)
"""


def test_ctrl_c_is_for_the_host_alone() -> None:
    def ready() -> None:
        # Whoever runs the tests may ignore the signal.
        signal.signal(signal.SIGINT, signal.default_int_handler)

    done = subprocess.run(
        [sys.executable, "-c", HOST_OF_CTRL_C],
        start_new_session=True,
        preexec_fn=ready,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert (done.stdout, done.stderr, done.returncode) == ("100\n", "", 0)


# A host with two simulators; it tells of them, and stays until it is killed.
HOST = """
import json, os, sys, time
from tmcl_sim import Sim
sims = [Sim(serial=True, rs485=True, can=True), Sim(firmware="canopen")]
watch = sims[0].watch(0.01, "rotor")
sims[0].send("ROR 0, 100")
sims[0].step(1.0)
FORK
print(json.dumps([sim.ready | {"fork": fork} for sim in sims]), flush=True)
time.sleep(600)
"""


@pytest.mark.parametrize("fork", ["0", "os.fork()"], ids=["alone", "forked"])
def test_a_host_that_is_killed(fork: str, folder: Path) -> None:
    # A child of the host lives on; it has copies of all that the host has open.
    code = HOST.replace("FORK", f"fork = {fork}\nif {fork != '0'} and not fork: time.sleep(600)")
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stdin=subprocess.DEVNULL) as host:
        assert host.stdout is not None
        told = json.loads(host.stdout.readline())
        assert all(is_running(ready["pid"]) and is_open(ready["control"]) for ready in told)
        assert sorted(os.listdir(folder)) == sorted(Path(told[0][link]).name for link in ("serial", "rs485"))
        host.kill()
        child = told[0]["fork"]
        try:
            wait_until(lambda: not any(is_running(ready["pid"]) for ready in told))
            assert child == 0 or is_running(child)
        finally:
            if child:
                os.kill(child, signal.SIGKILL)
    wait_until(lambda: os.listdir(folder) == [])
    addresses = [ready[link] for ready in told for link in ("control", "tcp", "slcan_tcp")]
    assert not any(is_open(address) for address in addresses)


def test_a_host_that_ends_without_closing(folder: Path) -> None:
    code = """
from tmcl_sim import Sim
sim = Sim(serial=True, paused=False, speed="max")
watch = sim.watch(0.001, "rotor")
print(sim.ready["pid"])
"""
    host = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert host.stderr == b""
    pid = int(host.stdout)
    assert not Path(f"/proc/{pid}").exists()
    assert os.listdir(folder) == []


def use(sim: Sim, watch: Watch, told: multiprocessing.SimpleQueue[str]) -> None:
    try:
        sim.state()
    except SimError as error:
        told.put(str(error))
    watch.close()
    sim.close()
    with Sim() as own:
        told.put(str(own.send("GAP 6, 0").value))


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_fork_leaves_the_simulator_alone() -> None:
    context = multiprocessing.get_context("fork")
    told: multiprocessing.SimpleQueue[str] = context.SimpleQueue()
    with Sim(serial=True) as sim, sim.watch(0.1, "rotor") as watch:
        sim.step(0.1)
        child = context.Process(target=use, args=(sim, watch, told))
        child.start()
        child.join()
        assert told.get() == "this Sim belongs to the process that has forked this one; start another Sim here"
        assert (told.get(), child.exitcode) == ("128", 0)
        assert sim.send("GAP 6, 0").value == 128
        sim.step(0.1)
        assert len(watch.samples()) == 2
        assert os.path.lexists(sim.serial)
