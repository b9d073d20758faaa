"""What stands in README.md is true: its files are written, its tests and programs run, and they say what it says.

A block of Python, TOML or the like whose first line is a comment with a name is that file. Other blocks of Python are
programs, and a text block after one is what it prints. In a console block a line `...` stands for any lines.
"""

from __future__ import annotations

import itertools
import re
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1]


def blocks(page: Path) -> list[tuple[str, str]]:
    """The fenced blocks of a page: what they are, and their text."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


BLOCKS = blocks(PACKAGE / "README.md")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with all files of the page."""
    for _, text in BLOCKS:
        if named := re.match(r"# (\S+\.\w+)\n", text):
            (tmp_path / named[1]).write_text(text)
    return tmp_path


def run(folder: Path, *arguments: str) -> str:
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True).stdout


PROGRAMS = [
    (program, printed)
    for (kind, program), (_, printed) in itertools.pairwise(BLOCKS)
    if kind == "python" and not program.startswith("# ")
]


@pytest.mark.parametrize(("program", "printed"), PROGRAMS)
def test_programs_print_what_the_page_says(folder: Path, program: str, printed: str) -> None:
    assert run(folder, "-c", program) == printed


CONSOLES = [text for kind, text in BLOCKS if kind == "console"]


@pytest.mark.parametrize("console", CONSOLES)
def test_pytest_says_what_the_page_says(folder: Path, console: str) -> None:
    command, _, shown = console.partition("\n")
    assert command.startswith("$ pytest ")
    pattern = re.escape(shown).replace(r"\.\.\.", "(?s:.*)")
    pattern = re.sub(r"in\\? \d+\\\.\d+s", r"in .*s", pattern)
    said = run(folder, "-m", *command.split()[1:])
    assert re.search(pattern, said), said


def test_all_tests_of_the_page_but_one_pass(folder: Path) -> None:
    assert re.search(r"^1 failed, 4 passed", run(folder, "-m", "pytest", "-q"), re.MULTILINE)


def test_the_test_in_the_chapter_on_host_software_passes(tmp_path: Path) -> None:
    chapter = PACKAGE.parent / "docs" / "host-software.md"
    [test] = [text for _, text in blocks(chapter) if text.startswith("# test_stop.py\n")]
    (tmp_path / "test_stop.py").write_text(test)
    assert "1 passed" in run(tmp_path, "-m", "pytest", "-q", "test_stop.py")


def test_there_is_something_to_run() -> None:
    assert (len(PROGRAMS), len(CONSOLES)) == (4, 3)
