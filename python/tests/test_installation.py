"""How the program `tmcl` is found, wherever an installer has put it."""

from __future__ import annotations

import sysconfig
from pathlib import Path

import pytest

from tmcl_sim import Sim, StartError, binary, installation


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder where an installer may put things; there is no program anywhere."""
    monkeypatch.delenv("TMCL_SIM_BINARY", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    monkeypatch.setattr(sysconfig, "get_path", lambda name, scheme="": str(tmp_path / scheme / name))
    monkeypatch.setattr(sysconfig, "get_preferred_scheme", lambda key: key)
    monkeypatch.setattr(installation, "__file__", str(tmp_path / "lib/python3/site-packages/tmcl_sim/installation.py"))
    return tmp_path


def put(program: Path) -> Path:
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    return program


@pytest.mark.parametrize("place", ["scripts", "user/scripts", "lib/python3/site-packages/bin", "bin", "path"])
def test_the_program_is_found(bare: Path, place: str) -> None:
    program = put(bare / place / "tmcl")
    assert binary() == str(program)


def test_that_of_the_package_comes_before_that_of_the_path(bare: Path) -> None:
    put(bare / "path" / "tmcl")
    program = put(bare / "scripts" / "tmcl")
    assert binary() == str(program)


def test_the_environment_names_another(bare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(bare / "scripts" / "tmcl")
    program = put(bare / "own" / "tmcl")
    monkeypatch.setenv("TMCL_SIM_BINARY", str(program))
    assert binary() == str(program)
    monkeypatch.setenv("TMCL_SIM_BINARY", str(bare))
    with pytest.raises(StartError, match=r"^the environment variable TMCL_SIM_BINARY names .* not a program"):
        binary()


@pytest.mark.usefixtures("bare")
def test_there_is_none() -> None:
    with pytest.raises(StartError, match=r"^there is no program tmcl: .*pip install --force-reinstall tmcl-sim"):
        Sim()
