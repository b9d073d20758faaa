#!/usr/bin/env python3
"""Writes down the licences of what is in programs: our own, and those of all crates and of Rust's libraries.

    scripts/licences.py FOLDER PACKAGE@TARGET[+FEATURE]...

FOLDER is where the files go; their names begin with LICENSE-, as python/pyproject.toml has them. A program is a package
of this workspace and the Rust target that it is built for, such as tmcl-cli@x86_64-pc-windows-gnu. A crate whose
licence is not in the list of deny.toml, or whose terms are nowhere, is an error.
"""

import json
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, TypeAlias

ROOT = Path(__file__).resolve().parent.parent

Package: TypeAlias = dict[str, Any]
"""A crate, as `cargo metadata` describes it."""

# Licences that a crate may have.
ALLOWED = set(tomllib.loads((ROOT / "deny.toml").read_text())["licenses"]["allow"])
# Files with terms, as crates call them.
TERMS = re.compile(r"(un)?licen[cs]e|copying|copyright|notice", re.IGNORECASE)


def is_allowed(expression: str) -> bool:
    """Whether an SPDX expression can be fulfilled by licences of ALLOWED; the old `MIT/Apache-2.0` means OR.

    >>> [is_allowed(text) for text in ("MIT", "GPL-3.0-only OR MIT", "GPL-2.0/MIT", "(ISC OR A) AND (B OR MIT)")]
    [True, True, True, True]
    >>> [is_allowed(text) for text in ("GPL-3.0-only", "MIT AND A", "Apache-2.0 WITH A", "A OR (B AND MIT)")]
    [False, False, False, False]
    """
    words = re.findall(r"[()]|[^\s()]+", expression.replace("/", " OR "))

    def alternatives() -> bool:
        is_met = all_of()
        while words and words[0] == "OR":
            words.pop(0)
            # Not in one expression: both sides have to be read.
            other = all_of()
            is_met = is_met or other
        return is_met

    def all_of() -> bool:
        is_met = licence()
        while words and words[0] == "AND":
            words.pop(0)
            other = licence()
            is_met = is_met and other
        return is_met

    def licence() -> bool:
        word = words.pop(0)
        if word == "(":
            is_met = alternatives()
            words.pop(0)
            return is_met
        if words and words[0] == "WITH":
            word = f"{word} {words.pop(0)} {words.pop(0)}"
        return word in ALLOWED

    return alternatives()


def cargo(*arguments: str) -> str:
    """What a command of cargo prints."""
    return subprocess.run(["cargo", *arguments], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def crates(programs: list[str]) -> list[Package]:
    """The crates of others that programs are made of, without those that only build or test them, by name and version.

    `cargo tree` knows which those are with the features that a program has, `cargo metadata` what stands in their
    manifests.
    """
    used = set()
    for program in programs:
        package, _, target = program.partition("@")
        target, _, features = target.partition("+")
        tree = cargo(
            "tree", "--locked", f"--package={package}", "--edges=normal", f"--target={target}", "--prefix=none",
            "--no-dedupe", "--format={p}", f"--features={features}",
        )  # fmt: skip
        used |= {tuple(line.split()[:2]) for line in tree.splitlines()}
    packages = json.loads(cargo("metadata", "--locked", "--format-version=1"))["packages"]
    others = [package for package in packages if package["source"] is not None]
    found = [package for package in others if (package["name"], f"v{package['version']}") in used]
    return sorted(found, key=lambda package: (package["name"], package["version"]))


def mit(notice: str) -> str:
    """The text of the MIT licence with a copyright notice in the place of ours."""
    text = (ROOT / "LICENSE-MIT").read_text()
    return re.sub(r"^Copyright .*$", lambda _: notice, text, count=1, flags=re.MULTILINE)


def terms(package: Package) -> list[str]:
    """The texts that come with a crate; where there are none, that of the MIT licence if it is offered."""
    folder = Path(package["manifest_path"]).parent
    named = [path for path in sorted(folder.iterdir()) if TERMS.match(path.name) and path.suffix != ".rs"]
    files = [file for path in named for file in (sorted(path.iterdir()) if path.is_dir() else [path])]
    if files:
        return [file.read_text() for file in files]
    if package["license"] == "BSL-1.0":
        # It leaves out of its condition what a compiler has made.
        return ["Boost Software License 1.0, https://www.boost.org/LICENSE_1_0.txt, which need not come with programs"]
    if not re.search(r"\bMIT\b", package["license"]):
        sys.exit(f"scripts/licences.py: {package['name']} comes without the text of its licence, {package['license']}")
    return [mit(f"Copyright (c) {', '.join(package['authors']) or 'the authors of ' + package['name']}")]


def of_crates(packages: list[Package]) -> str:
    """One text with the licences of all crates: first who has which, then each text once."""
    numbers: dict[str, int] = {}
    texts: list[str] = []
    table = []
    for package in packages:
        name, version, licence = package["name"], package["version"], package["license"]
        if licence is None or not is_allowed(licence):
            sys.exit(
                f"scripts/licences.py: {name} {version} has the licence {licence}, which is not one of those that are "
                "allowed here. Use another crate, or if anybody may pass on a program under it, add it to deny.toml."
            )
        own = []
        for text in terms(package):
            # The same text is often indented or broken into lines in another way.
            number = numbers.setdefault(" ".join(text.split()), len(texts) + 1)
            if number > len(texts):
                texts.append(text.strip("\n"))
            own.append(str(number))
        table.append(
            f"{name} {version}: {licence}; texts {', '.join(own)}; https://crates.io/crates/{name}/{version}\n"
        )
    rule = "-" * 80
    return (
        "The programs here have these crates in them. Behind each stands its licence, the numbers of its texts, which\n"
        "follow below, and where its source is.\n\n"
        + "".join(table)
        + "".join(f"\n{rule}\nText {number}\n{rule}\n\n{text}\n" for number, text in enumerate(texts, 1))
    )


def main() -> None:
    """Writes the files."""
    if len(sys.argv) < 3:
        sys.exit("usage: scripts/licences.py FOLDER PACKAGE@TARGET[+FEATURE]...")
    folder, programs = Path(sys.argv[1]), sys.argv[2:]
    for name in ("LICENSE-MIT", "LICENSE-APACHE"):
        shutil.copy(ROOT / name, folder / name)
    (folder / "LICENSE-crates.txt").write_text(of_crates(crates(programs)))
    # The compiler comes with the terms of the standard library and of what that is made of. The unwinder beside it is
    # under the LLVM exception, which asks for nothing here.
    sysroot = subprocess.run(
        ["rustc", "--print=sysroot"], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True
    ).stdout
    shutil.copy(Path(sysroot.strip()) / "share/doc/rust/COPYRIGHT-library.html", folder / "LICENSE-rust.html")
    if any("-musl" in program for program in programs):
        (folder / "LICENSE-musl.txt").write_text(mit("Copyright (c) 2005-2020 Rich Felker, et al."))


if __name__ == "__main__":
    main()
