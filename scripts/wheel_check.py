#!/usr/bin/env python3
"""Checks a wheel that scripts/wheel has built: size, licences, and the program in it.

    scripts/wheel_check.py WHEEL

The program has to be stripped, to need no library and no loader of the computer, to tell what it is, and not to tell in
which folder it was built.
"""

import hashlib
import os
import re
import struct
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import foreign

LARGEST = 8 << 20
"""Bytes that a wheel may have."""

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / "python/README.md"

HOMES = {"/home/", "/root/", "/Users/", "/.cargo/", "/.rustup/"}
"""What paths of a build have in them on most computers."""

LICENCES = {"LICENSE-MIT", "LICENSE-APACHE", "LICENSE-crates.txt", "LICENSE-rust.html"}
MUSL = {"LICENSE-musl.txt"}
"""What every wheel has; that of musl one for Linux, and others that are made together with one."""

FILES = ("tmcl_sim/__init__.py", "tmcl_sim/py.typed", "tmcl_sim/page/index.html", "tmcl_sim/page/tmcl_studio.wasm")
"""What a wheel has besides the program, among others."""

PRODUCTS = [
    name for file in ROOT.glob("src/product/*.rs") for name in re.findall(r'usb: "(TMCM-\d+)"', file.read_text())
]
"""The names of all products, as they stand in the sources."""

SYSTEM = re.compile(
    r"(kernel32|ntdll|msvcrt|ws2_32|advapi32|userenv|user32|shell32|ole32|bcrypt|bcryptprimitives|api-ms-win-.*)\.dll",
    re.IGNORECASE,
)
"""Libraries that each Windows has."""

# Of the ELF format: kinds of segments, of entries in the dynamic section, of sections.
PT_DYNAMIC, PT_INTERP = 2, 3
DT_NULL, DT_NEEDED = 0, 1
SHT_SYMTAB = 2

# Of the Mach-O format: commands in its header, and a processor.
LC_LOAD_DYLIB, LC_CODE_SIGNATURE = 0xC, 0x1D
CPU_ARM64 = 0x0100000C


def faults_of_the_program(program: bytes) -> list[str]:
    """What a program has that one which runs anywhere has not."""
    kinds = {"windows": faults_for_windows, "macos": faults_for_mac}
    faults = kinds.get(foreign.kind(program), faults_for_linux)(program)
    faults += [f"it has a path of the computer on which it was built: {path}" for path in paths_of_the_build(program)]
    return faults


def faults_for_windows(program: bytes) -> list[str]:
    """What a PE file of 64 bits has that one which runs on each Windows has not."""
    header = struct.unpack_from("<I", program, 0x3C)[0]
    sections, _, symbols, count, size = struct.unpack_from("<HIIIH", program, header + 6)
    at = header + 24 + size
    places = [struct.unpack_from("<IIII", program, at + 40 * number + 8) for number in range(sections)]

    def offset(address: int) -> int:
        return next(address - start + raw for size, start, _, raw in places if start <= address < start + size)

    def text(address: int) -> str:
        begin = offset(address)
        return program[begin : program.index(b"\0", begin)].decode()

    faults = ["it is not stripped"] if symbols and count else []
    imports = offset(struct.unpack_from("<I", program, header + 24 + 120)[0])
    for _, _, _, name, _ in struct.iter_unpack("<IIIII", program[imports : imports + 20 * 256]):
        if name == 0:
            break
        if not SYSTEM.match(text(name)):
            faults.append(f"it needs the library {text(name)}")
    return faults


def faults_for_mac(program: bytes) -> list[str]:
    """What a Mach-O file of 64 bits has that one which runs on each Mac has not, and a signature that is not its own."""
    faults, at, is_signed = [], 32, False
    processor, commands = struct.unpack_from("<I8xI", program, 4)
    for _ in range(commands):
        command, size = struct.unpack_from("<II", program, at)
        if command == LC_LOAD_DYLIB:
            library = program[at + struct.unpack_from("<I", program, at + 8)[0] : at + size].rstrip(b"\0").decode()
            if not library.startswith(("/usr/lib/", "/System/Library/Frameworks/")):
                faults.append(f"it needs the library {library}")
        elif command == LC_CODE_SIGNATURE:
            is_signed = True
            start, length = struct.unpack_from("<II", program, at + 8)
            faults += faults_of_the_signature(program, program[start : start + length])
        at += size
    if processor == CPU_ARM64 and not is_signed:
        faults.append("it has no signature, without which no program runs on Apple silicon")
    return faults


def faults_of_the_signature(program: bytes, signature: bytes) -> list[str]:
    """What a signature without an author says wrongly: it has a sum of each page of the file before it."""
    count = struct.unpack_from(">I", signature, 8)[0]
    blobs = [struct.unpack_from(">II", signature, 12 + 8 * number) for number in range(count)]
    directory = signature[next(at for slot, at in blobs if slot == 0) :]
    sums_at, _, _, pages, end = struct.unpack_from(">IIIII", directory, 16)
    size, kind, _, page = struct.unpack_from(">BBBB", directory, 36)
    if (size, kind) != (32, 2):
        return ["its signature has no sums by SHA-256"]
    for number in range(pages):
        content = program[number << page : min((number + 1) << page, end)]
        at = sums_at + size * number
        if hashlib.sha256(content).digest() != directory[at : at + size]:
            return [f"its signature is not that of its page {number}"]
    return []


def faults_for_linux(elf: bytes) -> list[str]:
    """What an ELF file of 64 bits has that one which runs anywhere has not."""
    if elf[:6] != b"\x7fELF\x02\x01":
        return ["it is no ELF file of 64 bits"]
    faults = []
    segments_at, sections_at = struct.unpack_from("<QQ", elf, 32)
    segment_size, segments, section_size, sections = struct.unpack_from("<HHHH", elf, 54)
    for number in range(segments):
        kind, _, offset, _, _, size = struct.unpack_from("<IIQQQQ", elf, segments_at + number * segment_size)
        if kind == PT_INTERP:
            faults.append(f"it needs the loader {elf[offset : offset + size - 1].decode()}")
        if kind == PT_DYNAMIC:
            for tag, _ in struct.iter_unpack("<QQ", elf[offset : offset + size]):
                if tag == DT_NULL:
                    break
                if tag == DT_NEEDED:
                    faults.append("it needs a shared library")
    kinds = [struct.unpack_from("<I", elf, sections_at + number * section_size + 4)[0] for number in range(sections)]
    if SHT_SYMTAB in kinds:
        faults.append("it is not stripped")
    return faults


def paths_of_the_build(program: bytes) -> list[str]:
    """Paths in a program that tell where it was built."""
    cargo = os.environ.get("CARGO_HOME", str(Path.home() / ".cargo"))
    sysroot = subprocess.run(["rustc", "--print", "sysroot"], check=True, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    folders = {str(ROOT), cargo, sysroot.stdout.strip(), os.environ.get("CARGO_TARGET_DIR", str(ROOT / "target"))}
    names = b"|".join(re.escape(name.encode()) for name in {*folders, *HOMES})
    return sorted(
        {found[0].decode(errors="replace") for found in re.finditer(rb"(%s)[\x21-\x7e]{0,80}" % names, program)}
    )


def faults_of_what_it_says(name: str, program: bytes) -> list[str]:
    """What `tmcl --version` leaves out."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(program)
        path.chmod(0o755)
        how, said = foreign.say(path, "--version")
    print(f"{how}: {said}")
    faults = []
    if not re.match(r"tmcl \d+\.\d+\.\d+ \([0-9a-f]{10}(-dirty)?\)\n", said):
        faults.append("it does not tell version and commit")
    faults += [
        f"it does not tell the firmware of a {name}" for name in PRODUCTS if not re.search(rf"{name} +TMCL \d", said)
    ]
    return faults


def faults_of(path: Path) -> list[str]:
    """What is wrong with a wheel."""
    faults = []
    size = path.stat().st_size
    print(f"{path.name}: {size / (1 << 20):.2f} MiB")
    if size >= LARGEST:
        faults.append(f"it has {size} bytes, and may have {LARGEST}")
    with zipfile.ZipFile(path) as wheel:
        names = wheel.namelist()
        licences = {name.rsplit("/", 1)[1] for name in names if ".dist-info/licenses/" in name}
        wanted = [LICENCES | MUSL] if "linux" in path.name else [LICENCES, LICENCES | MUSL]
        if licences not in wanted:
            faults.append(f"its licences are {sorted(licences)} in place of {sorted(wanted[0])}")
        programs = [name for name in names if re.search(r"\.data/scripts/tmcl(\.exe)?$", name)]
        if len(programs) != 1:
            return [*faults, "the program tmcl is not in it"]
        program = wheel.read(programs[0])
        wrong = faults_of_the_program(program) or faults_of_what_it_says(programs[0].rsplit("/", 1)[1], program)
        faults += [f"tmcl: {fault}" for fault in wrong]
        faults += [f"{file} is not in it" for file in FILES if file not in names]
        metadata = next(wheel.read(name).decode() for name in names if name.endswith(".dist-info/METADATA"))
        if metadata.partition("\n\n")[2].strip() != README.read_text().strip():
            faults.append(f"its description is not {README}")
    return faults


def main() -> None:
    """Prints what is wrong, and ends with code 1 if there is anything."""
    if len(sys.argv) != 2:
        sys.exit("usage: scripts/wheel_check.py WHEEL")
    faults = faults_of(Path(sys.argv[1]))
    for fault in faults:
        print(f"scripts/wheel_check.py: {fault}", file=sys.stderr)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
