"""A copy of the checkout with mutants in it, and its tests, built."""

import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import python
import rust
from areas import NOT_RUN, Area
from mutant import Mutant
from sources import alone, at_fault, with_choices


@dataclass(frozen=True)
class Test:
    """A binary of tests, or a file of them, with what starts it."""

    name: str
    command: tuple[str, ...]
    folder: Path
    # The argument with which all tests of a file run; a binary needs none.
    file: str | None = None

    def failed(self, line: str) -> str | None:
        """The test that this line of the output tells to have failed."""
        if line.startswith("test ") and line.endswith(" ... FAILED"):
            return line.removeprefix("test ").removesuffix(" ... FAILED")
        if line.startswith(("FAILED ", "ERROR ")):
            return line.split(" ")[1]
        return None

    def all_but(self, skipped: Sequence[str]) -> list[str]:
        """What starts all tests but these."""
        if self.file is not None:
            return [*self.command, self.file, *(f"--deselect={test}" for test in skipped)]
        return [*self.command, "--exact", *(f"--skip={test}" for test in skipped)] if skipped else [*self.command]

    def only(self, test: str) -> list[str]:
        """What starts one of the tests alone."""
        return [*self.command, test] if self.file is not None else [*self.command, test, "--exact"]


class Copy:
    """The sources as git knows them, in a folder of their own, with a build directory of their own that later runs use again."""

    def __init__(self, checkout: Path, areas: Sequence[Area]) -> None:
        """The areas are of one crate or package, and have the same tests."""
        self.crate, self.packages = areas[0].crate, areas[0].packages
        self.folder = checkout / "target" / "mutants" / "tree"
        self.checkout = checkout
        # As many tests at a time as Cargo lets go on, see .cargo/config.toml.
        threads = tomllib.loads((checkout / ".cargo" / "config.toml").read_text())["env"]["RUST_TEST_THREADS"]
        self.environment = {
            **os.environ, "CARGO_TARGET_DIR": str(checkout / "target" / "mutants" / "target"), "RUST_TEST_THREADS": threads,
        }  # fmt: skip
        # The tests run without a mutant first.
        self.environment.pop("MUTANT", None)
        for name in self.tracked():
            self.write(name, (checkout / name).read_bytes())
        self.sources = {name: (self.folder / name).read_bytes() for area in areas for name in self.tracked(*area.files)}

    def place(self, name: str) -> str:
        return name if self.crate == "." else f"{self.crate}/{name}"

    def tracked(self, *patterns: str) -> list[str]:
        specs = [f":(exclude){self.place(it[1:])}" if it.startswith("!") else f":(glob){self.place(it)}" for it in patterns]
        command = ["git", "ls-files", "-z", *specs]
        listed = subprocess.run(command, cwd=self.checkout, check=True, capture_output=True).stdout
        return [name for name in listed.decode().split("\0") if name and (self.checkout / name).is_file()]

    def write(self, name: str, text: bytes) -> None:
        """Writes only what is new, so that Cargo does not build again what has not changed."""
        path = self.folder / name
        if not path.exists() or path.read_bytes() != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)
            path.chmod((self.checkout / name).stat().st_mode)

    def mutants(self, area: Area) -> list[Mutant]:
        find = python.find if self.crate == "python" else rust.find
        names = [name for name in sorted(self.tracked(*area.files)) if not name.endswith("tests.rs")]
        return [mutant for name in names for mutant in find(name, self.sources[name])]

    def original(self) -> None:
        for name, source in self.sources.items():
            self.write(name, source)

    def with_all(self, mutants: Mapping[int, Mutant]) -> tuple[list[Test], set[int]]:
        """Builds the tests with all these mutants to choose from. Those that do not compile are left out, and returned."""
        out: set[int] = set()
        while True:
            placed = self.write_all({number: mutant for number, mutant in mutants.items() if number not in out})
            if self.crate == "python":
                return self.python_tests(), out
            tests, errors = self.cargo()
            if not errors:
                return tests, out
            wrong = set().union(*(at_fault(placed.get(name, []), start, end) for name, start, end in errors))
            if not wrong:
                sys.exit(f"the copy in {self.folder} does not compile: {errors}")
            out |= wrong

    def write_all(self, mutants: Mapping[int, Mutant]) -> dict:
        chosen = python.chosen if self.crate == "python" else rust.chosen
        placed = {}
        for name, source in self.sources.items():
            of_file = [(number, mutant) for number, mutant in mutants.items() if mutant.path == name]
            text, placed[name] = with_choices(source, of_file, chosen)
            self.write(name, text)
        if self.crate != "python":
            root = self.place("src/lib.rs")
            self.write(root, (self.checkout / root).read_bytes() + rust.CHOICE)
        return placed

    def with_one(self, mutant: Mutant) -> list[Test] | None:
        """Builds the tests with one mutant in place of the original; `None` if that does not compile."""
        self.original()
        self.write(mutant.path, alone(self.sources[mutant.path], mutant))
        tests, errors = self.cargo()
        return None if errors else tests

    def cargo(self) -> tuple[list[Test], list[tuple[str, int, int]]]:
        """Builds the tests; returns them, or the places of the errors."""
        # The programs too, which tests start.
        packages = [argument for package in self.packages for argument in ("--package", package)]
        command = ["cargo", "test", "--no-run", "--message-format=json", *packages]
        # A choice has parentheses, and a call that is left out returns nothing.
        environment = {**self.environment, "RUSTFLAGS": "--cap-lints allow"}
        done = subprocess.run(command, cwd=self.folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        tests, errors = [], []
        for line in done.stdout.splitlines():
            message = json.loads(line)
            if message.get("executable") and message["profile"]["test"]:
                name = message["target"]["name"]
                folder = Path(message["manifest_path"]).parent
                test = Test(name, (message["executable"],), folder)
                if name not in NOT_RUN:
                    tests.append(test)
            elif message["reason"] == "compiler-message" and message["message"]["level"] == "error":
                spans = [span for span in message["message"]["spans"] if span["is_primary"]]
                errors += [(self.relative(span["file_name"]), span["byte_start"], span["byte_end"]) for span in spans]
        if done.returncode != 0 and not errors:
            sys.exit(f"the copy in {self.folder} was not built:\n{done.stderr.decode()}")
        return tests, errors

    def relative(self, name: str) -> str:
        return str(Path(name).relative_to(self.folder)) if Path(name).is_absolute() else name

    def python_tests(self) -> list[Test]:
        """The package is not installed: its sources, its plugin and the program beside it are named instead."""
        subprocess.run(["cargo", "build", "--quiet", "--package", "tmcl-cli"], cwd=self.folder, env=self.environment, check=True)
        self.environment |= {
            "PYTHONPATH": str(self.folder / "python" / "src"), "PYTEST_PLUGINS": "tmcl_sim.pytest_plugin",
            "TMCL_SIM_BINARY": str(Path(self.environment["CARGO_TARGET_DIR"]) / "debug" / "tmcl"),
        }  # fmt: skip
        files = sorted((self.folder / "python" / "tests").glob("test_*.py"))
        start = (sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider")
        return [Test(file.stem, start, self.folder / "python", str(file)) for file in files]


def ordered(tests: Sequence[Test], area: Area) -> list[Test]:
    """Those that notice first before the others."""

    def rank(test: Test) -> int:
        return area.first.index(test.name) if test.name in area.first else len(area.first)

    return sorted(tests, key=rank)
