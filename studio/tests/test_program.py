"""Programs: edited, loaded, and followed step by step."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from bed import browser as browsers
from bed.browser import Browser
from bed.module import ROOT, VirtualModule
from bed.server import Site
from playwright.sync_api import Playwright, expect
from studio import Studio, tmcl

COUNT = "Count = 4\nLoop: CALC ADD, 100\nAGP Count, 2\nJA Loop\n"


@pytest.fixture
def studio(plain_chromium: Browser, studio_site: Site) -> Studio:
    """The page with a virtual module."""
    studio = Studio(plain_chromium.open(studio_site.url))
    studio.start()
    return studio


@pytest.fixture
def serial_studio(
    playwright: Playwright, tmp_path: Path, library: Path, ports: Path, studio_site: Site
) -> Iterator[Studio]:
    """The page in Chromium, which has all serial ports."""
    with browsers.chromium(playwright, tmp_path, library, ports, origins=[studio_site.origin]) as browser:
        yield Studio(browser.open(studio_site.url))


def state(studio: Studio, words: str) -> None:
    expect(studio.page.get_by_role("status", name="Debugger")).to_have_text(words)


def act(studio: Studio, line: str) -> None:
    """Carries a line of the debugger out, to its end."""
    typed = studio.page.get_by_role("textbox", name="Line of the debugger")
    said = studio.page.get_by_role("log", name="Debugged").get_by_role("listitem")
    count = said.filter(has_text="(tmcl) ").count()
    typed.fill(line)
    typed.press("Enter")
    expect(said.filter(has_text="(tmcl) ")).to_have_count(count + 1)
    expect(said.last).not_to_have_text(f"(tmcl) {line}")


def test_a_program_is_followed_step_by_step(studio: Studio) -> None:
    studio.load(COUNT)
    state(studio, "halted at line 2")
    studio.button("Step").click()
    state(studio, "halted at line 3")
    expect(studio.row("Registers", "acc")).to_have_text("100 (before 0)")
    studio.page.keyboard.press("F11")
    state(studio, "halted at line 4")
    expect(studio.row("User variables", "Count")).to_have_text("100 (before 0)")
    act(studio, "watch acc")
    expect(studio.row("Watched", "acc")).to_have_text("100")
    studio.button("Back to the beginning").click()
    state(studio, "halted at line 2")


def test_breakpoints_in_the_margin_have_conditions(studio: Studio) -> None:
    # Wanted before there is a program in the module.
    studio.program(COUNT)
    studio.button("Breakpoint at line 3").click()
    studio.load(COUNT)
    breakpoint_ = studio.page.get_by_role("textbox", name="Condition at program.tmc, line 3")
    expect(breakpoint_).to_be_visible()
    breakpoint_.fill("acc > 250")
    breakpoint_.press("Enter")
    expect(breakpoint_).to_have_value("acc > 250")
    studio.button("Continue").click()
    expect(studio.row("Registers", "acc")).to_contain_text("300")
    state(studio, "halted at line 3")
    studio.button("Remove: program.tmc, line 3").click()
    expect(studio.button("Breakpoint at line 3")).to_have_attribute("aria-pressed", "false")
    studio.button("Continue").click()
    state(studio, "the program runs")
    studio.button("Halt").click()
    expect(studio.page.get_by_role("status", name="Debugger")).to_contain_text("halted at line")


def test_what_becomes_of_a_program_is_told(studio: Studio) -> None:
    """Also if it ends by itself, or if something else than the debugger runs and stops it."""
    studio.load("WAIT TICKS, 0, 100\nSTOP\n")
    studio.button("Continue").click()
    state(studio, "the program has ended, or was stopped")
    studio.load("Loop: WAIT TICKS, 0, 1\nJA Loop\n")
    studio.button("Run").click()
    state(studio, "the program runs")
    # It is looked at again and again, and nothing is taken from under one's hands.
    act(studio, "break 0")
    typed = studio.page.get_by_role("textbox", name="Condition at program.tmc, line 1")
    typed.press_sequentially("acc > 5", delay=200)
    expect(typed).to_have_value("acc > 5")
    typed.press("Enter")
    expect(studio.page.get_by_role("log", name="Debugged")).to_contain_text("(tmcl) break 0 if acc > 5")
    expect(typed).to_have_value("acc > 5")
    studio.button("STOP").click()
    state(studio, "the program has ended, or was stopped")
    studio.load("STOP\n")
    studio.button("Step").click()
    state(studio, "the program has ended at line 1: a step begins it anew")
    act(studio, "break 0")
    condition = studio.page.get_by_role("textbox", name="Condition at program.tmc, line 1")
    condition.fill("foo bar")
    condition.press("Enter")
    expect(condition).to_have_attribute("aria-invalid", "true")


def test_a_continue_that_finds_no_end_is_halted(studio: Studio) -> None:
    studio.load(COUNT)
    act(studio, "break 0 if acc < -5")
    studio.button("Continue").click()
    expect(studio.page.get_by_role("log", name="Debugged")).to_contain_text("(tmcl) continue")
    studio.button("Halt").click()
    expect(studio.page.get_by_role("log", name="Debugged")).to_contain_text("interrupted")


def test_the_values_are_those_of_the_program_tmcl(studio: Studio, tmp_path: Path) -> None:
    lines = [
        "step",
        "step",
        "print acc",
        "print Count",
        "registers",
        "next 2",
        "break Loop",
        "continue",
        "axes",
        "list 0",
    ]
    path = tmp_path / "program.tmc"
    path.write_text(COUNT)
    script = tmp_path / "script"
    script.write_text("".join(f"{line}\n" for line in lines))
    expected = tmcl("debug", "sim", str(path), given=script)
    studio.load(COUNT)
    log = studio.page.get_by_role("log", name="Debugged").get_by_role("listitem")
    expect(log.last).to_contain_text("0  CALC ADD, 100")
    count = log.count()
    for line in lines:
        act(studio, line)
    said = [text for text in log.all_inner_texts()[count:] if not text.startswith("(tmcl) ")]
    for text in said:
        assert text in expected, text


def test_loading_over_another_program_asks_first(studio: Studio) -> None:
    studio.load(COUNT)
    state(studio, "halted at line 2")
    studio.program("ROR 0, 5\n")
    studio.button("Load program").click()
    dialog = studio.page.get_by_role("dialog")
    expect(dialog).to_contain_text("This is lost: the program in the module, which differs from address 0 on")
    dialog.get_by_role("button", name="Cancel").click()
    expect(dialog).to_have_count(0)
    assert studio.send("134, 0, 0, 0").startswith("134, 0, 0, 0: CALC ADD, 100")
    studio.button("Load program").click()
    dialog.get_by_role("button", name="Load").click()
    expect(studio.page.get_by_role("status", name="Loading")).to_contain_text("loaded to addresses 0 to 1")
    # The same once more is not asked about.
    studio.button("Load program").click()
    expect(studio.job("Load program").filter(has_text="done")).to_have_count(3)


def test_autostart_is_stored_after_a_question(studio: Studio) -> None:
    studio.program(COUNT)
    studio.page.get_by_role("checkbox", name="start after power-up").check()
    studio.button("Load program").click()
    dialog = studio.page.get_by_role("dialog")
    expect(dialog).to_contain_text("global parameter 77")
    dialog.get_by_role("button", name="Load").click()
    expect(studio.page.get_by_role("status", name="Loading")).to_contain_text("after power-up")
    assert studio.send("GGP 77, 0").startswith("GGP 77, 0: 1")


def test_the_program_of_the_module_is_a_text(studio: Studio) -> None:
    studio.load(COUNT)
    studio.button("Program of the module").click()
    texts = studio.page.get_by_role("combobox", name="Text", exact=True)
    # Two thousand telegrams.
    expect(texts).to_have_value("module.tmc")
    expect(studio.page.get_by_role("textbox", name="Program")).to_have_value(
        re.compile("^// TMCM-1140.*CALC ADD, 100", re.DOTALL)
    )
    expect(studio.page.get_by_role("status", name="Memory")).to_contain_text("4 of 2048 commands")
    studio.button("Attach").click()
    expect(studio.page.get_by_role("status", name="Debugger")).to_contain_text("halted at line")


def test_another_program_in_the_module_is_told_first(studio: Studio) -> None:
    studio.load(COUNT)
    studio.program("STOP\n")
    studio.button("Attach").click()
    expect(studio.page.get_by_role("log", name="Debugged")).to_contain_text("another program than this text")


def test_texts_include_each_other_and_nothing_else(studio: Studio) -> None:
    studio.button("New").click()
    texts = studio.page.get_by_role("combobox", name="Text", exact=True)
    studio.program("Slow = 77\n")
    studio.button("Rename").first.click()
    studio.page.get_by_role("textbox", name="New name").fill("speeds.inc")
    studio.page.get_by_role("textbox", name="New name").press("Enter")
    expect(texts).to_have_value("speeds.inc")
    texts.select_option("program.tmc")
    studio.load("#include speeds.inc\nROR 0, Slow\n")
    expect(studio.page.get_by_role("status", name="Loading")).to_contain_text("loaded to addresses")
    assert studio.send("134, 0, 0, 0").startswith("134, 0, 0, 0: ROR 0, 77")
    studio.program("#include other.inc\n")
    expect(studio.page.get_by_text("other.inc").first).to_be_visible()


def open_file(studio: Studio, file: Path, content: bytes) -> None:
    """Writes a file, and opens it as a text."""
    file.write_bytes(content)
    with studio.page.expect_file_chooser() as chooser:
        studio.button("Open file").click()
    chooser.value.set_files(file)


def test_texts_that_include_each_other_are_told(studio: Studio, tmp_path: Path) -> None:
    texts = studio.page.get_by_role("combobox", name="Text", exact=True)
    for name, other in (("a.inc", "b.inc"), ("b.inc", "a.inc")):
        open_file(studio, tmp_path / name, f"#include {other}\n".encode())
        expect(texts).to_have_value(name)
    expect(studio.page.get_by_role("list", name="Messages")).to_contain_text("include")
    expect(studio.page.get_by_role("status", name="Memory")).to_have_text("does not assemble")
    texts.select_option("program.tmc")
    studio.load(COUNT)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"ROR 0, 5 // \xff\n", "file.tmc is no text in UTF-8"),
        (b"// " + b"x" * 2 * 1024 * 1024, "files of up to 2097152 are opened here"),
    ],
    ids=["no UTF-8", "too large"],
)
def test_a_file_that_is_no_text_is_told(studio: Studio, tmp_path: Path, content: bytes, words: str) -> None:
    open_file(studio, tmp_path / "file.tmc", content)
    expect(studio.page.get_by_role("status", name="Loading")).to_contain_text(words)
    studio.load(COUNT)


def test_a_source_of_two_mebibytes_is_examined(studio: Studio, tmp_path: Path) -> None:
    lines = b"// a remark that fills a line\n" * 60_000
    last = b"ROR 0, 5\n" + b"JA Nowhere\n"
    open_file(studio, tmp_path / "large.tmc", (lines + b"\n" * (2 * 1024 * 1024 - len(lines) - len(last)) + last))
    expect(studio.page.get_by_role("list", name="Messages")).to_contain_text("Nowhere")
    studio.page.get_by_role("combobox", name="Text", exact=True).select_option("program.tmc")
    studio.load(COUNT)


def test_a_program_of_2049_commands_is_told(studio: Studio, tmp_path: Path) -> None:
    open_file(studio, tmp_path / "long.tmc", b"NOP\n" * 2049)
    studio.button("Load program").click()
    expect(studio.job("Look at the program").last).to_contain_text("the program is too long")


EXAMPLE = ROOT / "examples" / "stall_homing.tmc"
WORLD = ROOT / "examples" / "stall_homing.toml"


def homing(studio: Studio) -> None:
    """Writes the example with a mistake, mends it, loads it, and debugs it to its end: it has found its zero."""
    text = EXAMPLE.read_text()
    studio.program(text.replace("ROL", "ROLL", 1))
    studio.button("Use 'ROL'").first.click()
    expect(studio.page.get_by_role("textbox", name="Program")).to_have_value(text)
    studio.load(text)
    search = 1 + text.splitlines().index("        SAP APStopOnStall, Motor0, 0")
    act(studio, f"break :{search}")
    studio.button("Continue").click()
    state(studio, f"halted at line {search}")
    act(studio, "delete")
    studio.button("Step").click()
    studio.button("Step").click()
    assert studio.send("GAP 1, 0").startswith("GAP 1, 0: 0 ")
    studio.button("Continue").click()
    state(studio, "the program runs")
    expect(studio.row("Axes", "actual position (microsteps)")).to_have_text("51200")
    plotted(studio)


def plotted(studio: Studio) -> None:
    """The scope has the way to the wall, the zero there, and the way back; so has a picture of it."""
    studio.page.get_by_role("combobox", name="Window").select_option(label="10 min")
    with studio.page.expect_download() as csv:
        studio.button("CSV of all rows").click()
    heads, *rows = Path(csv.value.path()).read_text().splitlines()
    assert heads.split(",")[1] == "actual position (microsteps)"
    positions = [int(row.split(",")[1]) for row in rows if row.split(",")[1] != ""]
    zero = len(positions) - 1 - positions[::-1].index(0)
    assert min(positions) < 0, "the way to the wall"
    assert positions[-1] == 51200
    assert sorted(positions[zero:]) == positions[zero:], "the way back"
    with studio.page.expect_download() as svg:
        studio.button("SVG of the view").click()
    assert "actual position (microsteps)" in Path(svg.value.path()).read_text()


def test_the_example_on_a_virtual_module(studio: Studio) -> None:
    studio.button("New").click()
    studio.program(WORLD.read_text())
    studio.button("Rename").click()
    name = studio.page.get_by_role("textbox", name="New name")
    name.fill("stage.toml")
    name.press("Enter")
    studio.page.get_by_role("combobox", name="Text", exact=True).select_option("program.tmc")
    studio.page.get_by_role("combobox", name="World").select_option("stage.toml")
    studio.start()
    homing(studio)


def test_the_example_by_web_serial(serial_studio: Studio, ports: Path, tmp_path: Path) -> None:
    with VirtualModule(ports / "ttyACM0", tmp_path, "--world", str(WORLD)):
        serial_studio.connect()
        homing(serial_studio)


def test_a_world_with_a_mistake_is_told(studio: Studio) -> None:
    studio.button("New").click()
    studio.program("[motor]\nfrictoin = 1\n")
    studio.button("Rename").click()
    studio.page.get_by_role("textbox", name="New name").fill("wrong.toml")
    studio.page.get_by_role("textbox", name="New name").press("Enter")
    studio.page.get_by_role("combobox", name="World").select_option("wrong.toml")
    studio.button("Start").click()
    expect(studio.link).to_contain_text("frictoin")
