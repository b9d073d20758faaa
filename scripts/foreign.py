"""Programs for other systems than this one: what they are, and what they say here."""

import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path

RANDOM = Path(__file__).parent / "bcryptprimitives.c"
"""What older wines lack."""

MACHINES = {62: "x86_64", 183: "aarch64"}
"""Processors, by their numbers in ELF files."""

PREFIX = Path(__file__).resolve().parents[1] / "target/wine"
"""Where wine has its files, which it takes seconds to make."""


def kind(program: bytes) -> str:
    """What a program is for: "x86_64" or "aarch64" for one of Linux, "windows", "macos", or "unknown"."""
    if program[:4] == b"\x7fELF":
        return MACHINES.get(struct.unpack_from("<H", program, 18)[0], "unknown")
    if program[:4] == b"\xcf\xfa\xed\xfe":
        return "macos"
    return "windows" if program[:2] == b"MZ" else "unknown"


def runner(program: Path) -> tuple[str, list[str], dict[str, str]]:
    """How a program is run here: in words, the command in front of it, and the environment."""
    what = kind(program.read_bytes())
    environment = dict(os.environ)
    if what == "x86_64":
        return "natively", [], environment
    if what == "aarch64":
        return "by qemu", [_needed("qemu-aarch64", "qemu-user")], environment
    if what != "windows":
        sys.exit(f"{program} is a program of a kind that cannot be run here: {what}")
    compiler = _needed("x86_64-w64-mingw32-gcc", "gcc-mingw-w64-x86-64")
    library = program.parent / "bcryptprimitives.dll"
    subprocess.run([compiler, "-shared", "-o", library, RANDOM, "-ladvapi32"], check=True)
    PREFIX.parent.mkdir(exist_ok=True)
    return "in wine", [_needed("wine", "wine wine64")], {**environment, "WINEPREFIX": str(PREFIX), "WINEDEBUG": "-all"}


def say(program: Path, *arguments: str) -> tuple[str, str]:
    """Runs a program with arguments, and gives how it was run and what it printed."""
    how, command, environment = runner(program)
    said = subprocess.run(
        [*command, program, *arguments], check=True, stdout=subprocess.PIPE, env=environment, timeout=600
    )
    return how, said.stdout.decode().replace("\r\n", "\n")


def _needed(program: str, packages: str) -> str:
    if found := shutil.which(program):
        return found
    sys.exit(f"{program} is needed: apt-get install --no-install-recommends {packages}")
