"""Equal runs are equal: the example homes and stalls, ten times, with random sleeps of the host, and all telegrams are
the same at the same virtual times."""

from __future__ import annotations

import hashlib
import random
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

import homing
from tmcl_sim import Sim

RUNS = 10
# The longest of the host's sleeps, in seconds.
LONGEST_SLEEP = 0.003
WORLD = Path(homing.__file__).parent / "stage.toml"


def sleep(_: float) -> None:
    time.sleep(random.uniform(0, LONGEST_SLEEP))


def test_ten_runs_have_the_same_digest(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, pytestconfig: pytest.Config
) -> None:
    monkeypatch.setattr(homing, "time", SimpleNamespace(sleep=sleep))
    digests, rotors = set(), set()
    for run in range(RUNS):
        log = tmp_path / f"{run}.txt"
        with Sim(WORLD, paused=0.010, log=log, image=pytestconfig.getoption("--tmcl-sim-image")) as sim:
            sim.at(4.0, "load 1")
            assert homing.main([*sim.pytrinamic.split(), "300000"]) == 1
            rotors.add(sim.state().rotor)
        assert len(log.read_text().splitlines()) > 100
        digests.add(hashlib.sha256(log.read_bytes()).hexdigest())
    assert len(digests) == len(rotors) == 1
