"""Finds the program `tmcl`, which is installed together with this package."""

from __future__ import annotations

import os
import shutil
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

from .errors import StartError

PROGRAM = "tmcl.exe" if sys.platform == "win32" else "tmcl"
VARIABLE = "TMCL_SIM_BINARY"


def binary() -> str:
    """The path of the program `tmcl`: that of the environment variable TMCL_SIM_BINARY, else the one that was installed
    with this package, else the one on the PATH.

    Raises StartError if there is none.
    """
    if named := os.environ.get(VARIABLE):
        return _runnable(named, f"the environment variable {VARIABLE} names")
    for folder in _folders():
        if _is_program(path := folder / PROGRAM):
            return str(path)
    if found := shutil.which(PROGRAM):
        return found
    raise StartError(
        f"there is no program {PROGRAM}: it comes with the package, so `pip install --force-reinstall tmcl-sim` "
        f"brings it back; or name one of your own in the environment variable {VARIABLE}"
    )


def _folders() -> Iterator[Path]:
    """Where an installer may have put programs: the scripts of this interpreter, those of the user, and those beside
    the package, for `pip install --target` and `--prefix`."""
    yield Path(sysconfig.get_path("scripts"))
    yield Path(sysconfig.get_path("scripts", sysconfig.get_preferred_scheme("user")))
    packages = Path(__file__).resolve().parent.parent
    yield packages / "bin"
    # In a prefix the package is in lib/python3.X/site-packages.
    if len(packages.parents) >= 3:
        yield packages.parents[2] / "bin"


def _runnable(path: str, whence: str) -> str:
    if not _is_program(Path(path)):
        raise StartError(f"{whence} {path}, which is not a program that can be run")
    return path


def _is_program(path: Path) -> bool:
    return path.is_file() and os.access(path, os.X_OK)
