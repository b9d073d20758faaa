"""A small world for a browser: namespaces of mounts and processes, in which serial ports are those of the test.

The browser sees files that are nowhere else on the computer, such as a policy. Of the computer's devices it sees those
without which no program runs; Firefox opens each of /dev when it looks for serial ports, and some devices mind being
opened. All processes end with the first one, and that ends with whoever has started it.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "udev" / "libudev.c"
# A list for /proc/tty/drivers: name, nodes, major number, minor numbers, type.
DRIVERS = "acm /dev/ttyACM 166 0-255 serial\n"

# Mounts, in a shell of the namespace: $1 is a folder of the test.
MOUNTS = """
mount --bind "$1/drivers" /proc/tty/drivers
mount -t tmpfs tmpfs "$1/dev"
for name in full null ptmx random tty urandom zero; do
    touch "$1/dev/$name"
    mount --bind "/dev/$name" "$1/dev/$name"
done
for name in pts shm; do
    mkdir "$1/dev/$name"
    mount --rbind "/dev/$name" "$1/dev/$name"
done
ln -s /proc/self/fd "$1/dev/fd"
mount --rbind "$1/dev" /dev
"""


def compile_library(folder: Path) -> Path:
    """Compiles the stand-in for libudev."""
    library = folder / "libudev.so.1"
    # Under the name of the real one, which is not loaded then.
    options = ["-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror", f"-Wl,-soname,{library.name}"]
    subprocess.run(["cc", *options, "-o", library, SOURCE], check=True)
    return library


def installed(name: str) -> Path:
    """The path of a program."""
    if found := shutil.which(name):
        return Path(found)
    raise FileNotFoundError(f"{name} is not installed: `apt-get install {name}` brings it")


def enclose(folder: Path, program: Path, library: Path, ports: Path, layers: Mapping[Path, Path]) -> Path:
    """Writes a script that runs a program in the world of a test, and gives its path.

    Entries of the folder `ports` are its serial ports. `layers` has folders whose files the program sees in others,
    which have to exist. `folder` is for what the script needs, and has the program's home.
    """
    for name in ("dev", "home"):
        (folder / name).mkdir()
    (folder / "drivers").write_text(DRIVERS)
    mounts = MOUNTS
    for upper, lower in layers.items():
        mounts += (
            shlex.join(["mount", "-t", "overlay", "overlay", "-o", f"lowerdir={upper}:{lower}", str(lower)]) + "\n"
        )
    variables = [f"HOME={folder / 'home'}", f"LD_PRELOAD={library}", f"STAND_IN_PORTS={ports}"]
    inside = f'{mounts}shift\nexec env {shlex.join(variables)} {shlex.quote(str(program))} "$@"\n'
    options = ["--mount", "--pid", "--fork", "--kill-child", "--mount-proc"]
    if os.geteuid() != 0:
        options.append("--map-root-user")
    script = folder / "enclosed"
    words = ["unshare", *options, "/bin/sh", "-ec", inside, "sh", str(folder)]
    script.write_text(f'#!/bin/sh\nexec {shlex.join(words)} "$@"\n')
    script.chmod(0o755)
    return script
