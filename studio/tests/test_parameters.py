"""Parameters: the panel alone, on a virtual module."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe  # type: ignore[import-untyped]
from bed.browser import Browser, until
from bed.module import ROOT
from bed.server import Site
from playwright.sync_api import Locator, Page, expect
from studio import FOLDER

PAGE = ROOT / "studio" / "page"
HTML = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Parameters</title>
<link rel="icon" href="data:,">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="stylesheet" href="style.css"><link rel="stylesheet" href="panels/parameters.css"></head>
<body><main><h1>Parameters</h1><section aria-labelledby="title"><h2 id="title">Parameters</h2>
<div id="parameters"></div></section></main><div id="dialogs"></div>
<script type="module" src="test.js"></script></body></html>"""
SCRIPT = """import { Session } from './session.js';
import { question } from './question.js';
import { download, openFile } from './files.js';
import { ParametersPanel } from './panels/parameters.js';
const session = new Session(await WebAssembly.compileStreaming(fetch('tmcl_studio.wasm')), () => {});
const play = globalThis.play = { jobs: [], announced: [], holds: false, held: [] };
const services = {
    ask: (door, asked) => session.look(door, asked),
    job: async (name, door, asked) => {
        play.jobs.push({ name, door, asked });
        if (play.holds) { await new Promise((go) => play.held.push(go)); }
        const { id, answer } = session.job(door, asked);
        if (play.endsAll) { session.end(id); }
        return answer;
    },
    question, download, openFile, announce: (text) => play.announced.push(text),
};
play.panel = new ParametersPanel(document.querySelector('#parameters'), services, {});
play.start = async (product, axis = 0, told = product) => {
    await session.open({ virtual: { product, world: null } }, 1);
    await session.identify();
    await play.panel.module(told, axis);
};
play.send = async (line) => (await session.job('tools_send', { line }).answer).text;
"""


class Panel:
    """A page with nothing but the panel."""

    def __init__(self, page: Page):
        self.page = page
        self.state = page.get_by_role("status", name="State of the parameters")
        self.count = page.get_by_role("status", name="Parameters shown")
        self.table = page.get_by_role("table", name="Parameters", exact=True)
        self.import_ = page.get_by_role("group", name="Import")
        expect(self.state).to_have_text("no module")

    def start(self, product: str = "1140", axis: int = 0) -> None:
        """A module is there."""
        self.page.evaluate("([product, axis]) => play.start(product, axis)", [product, axis])
        expect(self.state).to_contain_text("read")

    def send(self, line: str) -> str:
        """What the module replies, in words."""
        told: str = self.page.evaluate("line => play.send(line)", line)
        return told

    def value(self, line: str) -> int:
        """The value that the module has."""
        found = re.search(r": (-?\d+)", self.send(line))
        assert found
        return int(found[1])

    def input(self, name: str) -> Locator:
        return self.page.get_by_role("textbox", name=name, exact=True)

    def row(self, name: str) -> Locator:
        header = self.page.get_by_role("rowheader", name=re.compile(rf"^\d+ {re.escape(name)}$"))
        return self.table.get_by_role("row").filter(has=header)

    def button(self, name: str) -> Locator:
        return self.page.get_by_role("button", name=name, exact=True)

    def bank(self, name: str) -> None:
        self.page.get_by_label("Bank").select_option(name)

    def jobs(self, door: str) -> list[dict[str, Any]]:
        """The jobs that were given at a door."""
        jobs: list[dict[str, Any]] = self.page.evaluate("door => play.jobs.filter(job => job.door === door)", door)
        return jobs

    def type(self, name: str, text: str) -> None:
        self.input(name).fill(text)
        self.input(name).press("Enter")

    def answer(self, title: str, words: str, button: str) -> None:
        """Answers a question that has these words."""
        dialog = self.page.get_by_role("dialog", name=title)
        expect(dialog).to_contain_text(words)
        dialog.get_by_role("button", name=button, exact=True).click()
        expect(dialog).to_have_count(0)

    def choose(self, name: str, text: str | bytes) -> None:
        """Imports a file."""
        with self.page.expect_file_chooser() as chooser:
            self.button("Import").click()
        data = text if isinstance(text, bytes) else text.encode()
        chooser.value.set_files({"name": name, "mimeType": "text/plain", "buffer": data})


@pytest.fixture
def hosted(site: Site) -> Site:
    """A server of the page with the panel."""
    shutil.copytree(PAGE, site.folder, dirs_exist_ok=True)
    shutil.copy(FOLDER / "tmcl_studio.wasm", site.folder)
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', (FOLDER / "index.html").read_text())
    assert policy
    site.write(index__html=HTML.replace("{policy}", policy[1]), test__js=SCRIPT)
    return site


@pytest.fixture
def panel(plain_chromium: Browser, hosted: Site) -> Panel:
    return Panel(plain_chromium.open(hosted.url))


def test_a_row_has_all_that_the_tables_say(panel: Panel) -> None:
    panel.start("3110")
    cells = panel.row("maximum current").get_by_role("cell")
    expect(panel.input("maximum current")).to_have_value("128")
    assert [cells.nth(index).inner_text() for index in (2, 3, 4)] == ["1/255", "0..255", "128"]
    expect(panel.row("actual position")).to_be_visible()
    expect(panel.row("serial address")).to_be_hidden()
    panel.bank("global")
    expect(panel.input("serial address")).to_have_value("1")
    expect(panel.row("maximum current")).to_be_hidden()
    panel.bank("interrupt")
    expect(panel.input("timer 2 period")).to_have_value("0")
    panel.bank("axis")
    panel.page.get_by_role("searchbox", name="Search").fill("stall threshold")
    expect(panel.count).to_have_text(re.compile(r"^1 of \d+ parameters$"))
    expect(panel.row("stallGuard2 threshold")).to_be_visible()
    panel.button("Note: stallGuard2 threshold").click()
    expect(panel.row("stallGuard2 threshold")).to_contain_text("higher = less sensitive")


def test_what_reading_clears_is_read_by_a_button_alone(panel: Panel) -> None:
    panel.start()
    panel.button("Read all").click()
    expect(panel.state).to_have_text("read, but not what is cleared by that: extended error flags")
    read = [place["number"] for job in panel.jobs("parameters_read") for place in job["asked"]["of"]]
    assert 207 not in read
    row = panel.row("extended error flags")
    expect(row.get_by_role("cell").nth(1)).to_have_text("-")
    panel.button("Read and clear: extended error flags").click()
    expect(row.get_by_role("cell").nth(1)).to_have_text("0")


def test_a_value_is_written_and_compared(panel: Panel) -> None:
    panel.start()
    panel.type("maximum current", "$4D")
    expect(panel.row("maximum current")).to_contain_text("differs from default; changed, was 128")
    expect(panel.input("maximum current")).to_have_value("77")
    assert panel.value("GAP 6, 0") == 77
    # Leaving the field writes nothing; and the default again is still a change only if it was read otherwise.
    panel.input("standby current").fill("9")
    panel.page.get_by_role("searchbox", name="Search").focus()
    expect(panel.row("standby current")).to_contain_text("not written")
    panel.input("standby current").press("Enter")
    expect(panel.row("standby current")).to_contain_text("changed, was 8")
    for box, count in (("Changed", 2), ("Differs from default", 2)):
        panel.page.get_by_label(box).check()
        expect(panel.count).to_have_text(re.compile(f"^{count} of"))
        panel.page.get_by_label(box).uncheck()
    panel.type("standby current", "8")
    expect(panel.row("standby current")).not_to_contain_text("changed")
    # What has moved by itself is no change of the user's.
    panel.send("SAP 1, 0, 500")
    panel.button("Read all").click()
    expect(panel.input("actual position")).to_have_value("500")
    expect(panel.row("actual position")).not_to_contain_text("changed")


def test_what_does_not_fit_is_not_sent(panel: Panel) -> None:
    panel.start()
    for text, words in (("256", "maximum current takes 0..255"), ("", "''"), ("lots", "'lots'"), ("1e3", "'1e3'")):
        panel.type("maximum current", text)
        expect(panel.row("maximum current")).to_contain_text(words)
        expect(panel.input("maximum current")).to_have_attribute("aria-invalid", "true")
    assert panel.jobs("parameters_write") == []
    assert "maximum current: maximum current takes 0..255" in panel.page.evaluate("play.announced")
    panel.input("maximum current").press("Escape")
    expect(panel.input("maximum current")).to_have_value("128")
    expect(panel.row("maximum current")).not_to_contain_text("takes 0..255 ")


def test_a_refusal_is_told_at_its_row(panel: Panel) -> None:
    panel.start("1110")
    panel.type("pulse divisor", "13")
    expect(panel.row("pulse divisor")).to_contain_text("changed, was 3")
    panel.type("ramp divisor", "0")
    expect(panel.row("ramp divisor")).to_contain_text("SAP 153, 0, 0: status 4")
    expect(panel.input("ramp divisor")).to_have_attribute("aria-invalid", "true")
    assert panel.value("GAP 153, 0") == 7
    # The lock of the EEPROM.
    panel.send("SGP 73, 0, 1234")
    panel.button("Store: maximum current").click()
    panel.answer("Store maximum current?", "is stored in the EEPROM of the module is lost", "Store")
    expect(panel.row("maximum current")).to_contain_text("STAP 6, 0: status 5")
    expect(panel.state).to_contain_text("stored: 0, refused: 1")


def test_what_the_module_stores_by_itself_is_written_after_a_question(panel: Panel) -> None:
    panel.start()
    panel.bank("global")
    panel.type("serial address", "7")
    panel.answer("Write serial address?", "may not answer any more", "Cancel")
    expect(panel.input("serial address")).to_have_value("1")
    assert panel.jobs("parameters_write") == []
    assert panel.value("GGP 66, 0") == 1
    panel.type("end switch polarity", "1")
    panel.answer("Write end switch polarity?", "the module stores 1 by itself at once", "Write")
    expect(panel.row("end switch polarity")).to_contain_text("changed, was 0")
    assert panel.value("GGP 79, 0") == 1


def test_one_parameter_or_all_changed_are_stored_after_a_question(panel: Panel) -> None:
    panel.start()
    panel.type("maximum current", "70")
    expect(panel.row("maximum current")).to_contain_text("changed")
    panel.button("Store: maximum current").click()
    panel.answer("Store maximum current?", "The EEPROM wears", "Cancel")
    panel.send("RSAP 6, 0")
    assert panel.value("GAP 6, 0") == 128
    panel.button("Read all").click()
    expect(panel.input("maximum current")).to_have_value("128")
    panel.button("Store all changed").click()
    expect(panel.state).to_contain_text("nothing has changed")
    panel.type("maximum current", "71")
    panel.type("standby current", "9")
    expect(panel.row("standby current")).to_contain_text("changed")
    panel.button("Store all changed").click()
    panel.answer("Store all changed?", "That takes 2 writes to the EEPROM.", "Store")
    expect(panel.state).to_have_text("stored: 2, refused: 0")
    panel.send("SAP 6, 0, 1")
    panel.send("RSAP 6, 0")
    assert panel.value("GAP 6, 0") == 71


def test_store_all_names_the_number_of_writes(panel: Panel) -> None:
    panel.start("6110", 5)
    panel.button("Store all").click()
    dialog = panel.page.get_by_role("dialog", name="Store all?")
    expect(dialog).to_contain_text("The EEPROM wears with each write")
    found = re.search(r"That takes (\d+) writes to the EEPROM", dialog.inner_text())
    assert found
    dialog.get_by_role("button", name="Store", exact=True).click()
    expect(panel.state).to_have_text(f"stored: {found[1]}, refused: 0")
    assert int(found[1]) % 6 == 0
    assert len(panel.jobs("parameters_store")[0]["asked"]["of"]) == int(found[1])


def test_a_module_that_does_not_store_says_so(panel: Panel) -> None:
    panel.start("3212")
    expect(panel.button("Store: maximum current")).to_have_count(0)
    panel.button("Store all").click()
    expect(panel.state).to_contain_text("keep them in a file")
    assert panel.jobs("parameters_store") == []


def test_values_in_turns_and_milliamperes(panel: Panel) -> None:
    panel.start()
    units = panel.page.get_by_label("Shown in")
    units.select_option("Turns and mA")
    expect(panel.row("maximum positioning speed")).to_contain_text("turns/s")
    panel.type("maximum positioning speed", "60 rpm")
    expect(panel.input("maximum positioning speed")).to_have_value("1")
    assert panel.value("GAP 4, 0") == 1678
    panel.type("maximum current", "1.2 A")
    expect(panel.input("maximum current")).to_have_value("1187.5")
    assert panel.value("GAP 6, 0") == 151
    panel.type("maximum positioning speed", "2")
    expect(panel.row("maximum positioning speed")).to_contain_text("at most")
    panel.input("maximum positioning speed").press("Escape")
    panel.page.get_by_label("Full steps per turn").fill("400")
    panel.page.get_by_label("Full steps per turn").press("Enter")
    expect(panel.input("maximum positioning speed")).to_have_value("0.5001")
    # A divisor halves what all speeds are.
    panel.type("pulse divisor", "4")
    expect(panel.input("maximum positioning speed")).to_have_value("0.25")


def test_each_axis_has_a_unit_of_its_own(panel: Panel) -> None:
    panel.start("3212", 1)
    panel.page.get_by_label("Shown in").select_option("A unit of my own")
    expect(panel.state).to_contain_text("give the unit of axis 1 a name")
    panel.page.get_by_label("Name of the unit").fill("mm")
    panel.page.get_by_label("Microsteps for one").fill("12800")
    panel.page.get_by_label("Microsteps for one").press("Enter")
    expect(panel.row("actual position")).to_contain_text("mm")
    panel.type("maximum positioning speed", "2.5")
    expect(panel.row("maximum positioning speed")).to_contain_text("mm/s")
    expect(panel.row("maximum positioning speed")).to_contain_text("changed")
    assert panel.value("GAP 4, 1") == 32_000
    panel.page.evaluate("play.panel.module('3212', 0)")
    expect(panel.state).to_contain_text("read")
    expect(panel.page.get_by_label("Name of the unit")).to_have_value("")
    expect(panel.input("maximum positioning speed")).not_to_have_value("2.5")
    panel.page.evaluate("play.panel.module('3212', 1)")
    expect(panel.input("maximum positioning speed")).to_have_value("2.5")
    expect(panel.row("maximum positioning speed")).to_contain_text("changed, was")


def test_a_module_that_is_not_known_has_numbers(panel: Panel) -> None:
    panel.page.evaluate("play.start('1140', 0, null)")
    expect(panel.input("maximum current")).to_have_value("128")
    panel.page.get_by_label("Shown in").select_option("Turns and mA")
    expect(panel.state).to_contain_text("not known")
    panel.page.get_by_label("Shown in").select_option("Units of the module")
    panel.type("maximum current", "300")
    expect(panel.row("maximum current")).to_contain_text("SAP 6, 0, 300: status 4")


FILE = """// Settings of a module 1140V142, saved by tmcl params
SAP 6, 0, 90 // maximum current
SAP 7, 0, 11
SAP 4, 0, 1000
SAP 12, 0, 300
SAP 154, 3, 1
SGP 65, 0, 7
SGP 3, 2, 42
"""


def line(panel: Panel, name: str) -> Locator:
    rows = panel.import_.get_by_role("row")
    return rows.filter(has=panel.page.get_by_role("rowheader", name=name, exact=True))


def test_an_import_shows_the_difference_and_writes_what_is_ticked(panel: Panel) -> None:
    panel.start()
    panel.choose("mine.tmcl", FILE)
    expect(panel.import_).to_contain_text("6 of 7 settings of mine.tmcl differ from the module's, 1 are the same.")
    assert panel.jobs("parameters_restore") == []
    assert line(panel, "maximum current").get_by_role("cell").all_inner_texts() == ["", "128", "90", ""]
    expect(line(panel, "maximum positioning speed")).to_have_count(0)
    expect(line(panel, "right limit switch disable")).to_contain_text("it takes 0..1")
    expect(line(panel, "pulse divisor")).to_contain_text("a TMCM-1140 has no axis 3")
    ticked = {"maximum current", "standby current", "user variable 3"}
    for name in (*ticked, "right limit switch disable", "pulse divisor", "RS485 baud rate"):
        tick = panel.page.get_by_role("checkbox", name=f"Write {name}")
        expect(tick).to_be_checked(checked=name in ticked)
    panel.page.get_by_role("checkbox", name="Write standby current").uncheck()
    panel.page.get_by_role("checkbox", name="Write right limit switch disable").check()
    panel.button("Write ticked").click()
    expect(panel.state).to_have_text("written: 2, refused: 1")
    expect(line(panel, "right limit switch disable")).to_contain_text("SAP 12, 0, 300: status 4")
    assert line(panel, "maximum current").get_by_role("cell").all_inner_texts() == ["", "90", "90", "written"]
    assert (panel.value("GAP 6, 0"), panel.value("GAP 7, 0"), panel.value("GGP 3, 2")) == (90, 8, 42)
    expect(panel.input("maximum current")).to_have_value("90")
    panel.button("Close the import").click()
    expect(panel.import_).to_have_count(0)


def test_an_import_asks_before_it_stores(panel: Panel) -> None:
    panel.start()
    panel.choose("mine.tmcl", FILE)
    panel.page.get_by_label("Store in the EEPROM, too").check()
    panel.button("Write ticked").click()
    panel.answer("Write 3 lines of mine.tmcl?", "That takes 3 writes to the EEPROM", "Cancel")
    assert panel.jobs("parameters_restore") == []
    panel.button("Write ticked").click()
    panel.answer("Write 3 lines of mine.tmcl?", "are lost", "Write")
    expect(panel.state).to_have_text("written: 3, refused: 0")
    panel.send("SAP 6, 0, 1")
    panel.send("RSAP 6, 0")
    assert panel.value("GAP 6, 0") == 90


BAD: dict[str, tuple[str | bytes, str]] = {
    "another product": (FILE.replace("1140V", "6110V"), "has the settings of a TMCM-6110"),
    "a later version": (FILE + "SAX 4, 0, 7\n", "mine.tmcl:9: "),
    "nonsense": ("\x00\x01 dance\n", "mine.tmcl:1: "),
    "a program": ("ROR 0, 100\n", "mine.tmcl:1: ROR 0, 100 is not a setting"),
    "no text": (b"\xff\xfe\x00", "mine.tmcl is no text in UTF-8"),
    "an image": (b"\x00" * (2 * 1024 * 1024 + 1), "files of up to 2097152 are opened here"),
}


@pytest.mark.parametrize("what", BAD)
def test_a_file_that_is_none_is_told(panel: Panel, what: str) -> None:
    text, words = BAD[what]
    panel.start()
    panel.choose("mine.tmcl", text)
    expect(panel.state).to_contain_text(words)
    expect(panel.import_).to_have_count(0)
    panel.type("maximum current", "5")
    expect(panel.row("maximum current")).to_contain_text("changed")


def test_an_export_is_imported_without_a_difference(panel: Panel) -> None:
    panel.start("3110", 2)
    panel.type("maximum current", "99")
    with panel.page.expect_download() as got:
        panel.button("Export").click()
    text = Path(got.value.path()).read_text()
    assert got.value.suggested_filename == "settings-3110.tmcl"
    assert "SAP 6, 2, 99 // maximum current" in text
    panel.choose("again.tmcl", text)
    expect(panel.import_).to_contain_text(re.compile(r"^Import0 of \d+ settings of again.tmcl differ"))
    expect(panel.button("Write ticked")).to_have_count(0)


def test_favourites_and_choices_are_kept(panel: Panel) -> None:
    panel.start()
    star = panel.button("Favourite: maximum current")
    star.click()
    expect(star).to_have_attribute("aria-pressed", "true")
    panel.page.get_by_label("Favourites", exact=True).check()
    expect(panel.count).to_have_text(re.compile("^1 of"))
    panel.page.get_by_label("Bank").select_option("all")
    panel.page.get_by_label("Shown in").select_option("physical")
    kept = panel.page.evaluate("play.panel.state()")
    assert kept == {"favourites": ["axis/6"], "bank": "all", "units": "physical", "own": {}, "steps": {}}
    panel.page.reload()
    panel = Panel(panel.page)
    panel.page.evaluate("kept => play.panel.restore(kept)", kept)
    panel.start()
    expect(star).to_have_attribute("aria-pressed", "true")
    expect(panel.input("maximum current")).to_have_value("1062.5")


def test_what_was_kept_may_be_edited_by_hand(panel: Panel) -> None:
    good = {"favourites": [], "bank": "axis", "units": "module", "own": {}, "steps": {}}
    wrong: list[Any] = [None, 5, "x", [], {"favourites": 5}, {"favourites": [5, "axis/x", "__proto__"]}]
    wrong += [{"bank": "x", "units": "__proto__", "own": [1], "steps": "abc"}, {"own": {"x": {}, "1": {"name": ""}}}]
    wrong += [{"own": {"0": {"name": "mm", "microsteps": 0}}, "steps": {"0": 0.5, "1": 70_000}}]
    for state in wrong:
        told = panel.page.evaluate("state => { play.panel.restore(state); return play.panel.state(); }", state)
        assert told == good, state
    some = {
        "favourites": ["axis/6", "axis/6", 7],
        "bank": "global",
        "own": {"0": {"name": "mm", "microsteps": 2, "x": 1}},
    }
    told = panel.page.evaluate("state => { play.panel.restore(state); return play.panel.state(); }", some)
    own = {"0": {"name": "mm", "microsteps": 2}}
    assert told == {**good, "favourites": ["axis/6"], "bank": "global", "own": own}
    panel.start()


def test_a_module_that_goes_takes_its_values_with_it(panel: Panel) -> None:
    panel.start()
    panel.page.evaluate("play.holds = true")
    panel.input("maximum current").fill("5")
    panel.input("maximum current").press("Enter")
    until(panel.page, "play.held.length === 1")
    panel.page.evaluate("play.panel.gone()")
    expect(panel.state).to_have_text("no module")
    expect(panel.table.get_by_role("rowheader")).to_have_count(0)
    panel.page.evaluate("play.holds = false; play.held.forEach(go => go())")
    for name in ("Read all", "Store all", "Store all changed", "Export", "Import"):
        expect(panel.button(name)).to_be_disabled()
    panel.start("6110", 3)
    expect(panel.input("maximum current")).to_have_value("128")
    expect(panel.row("maximum current")).not_to_contain_text("changed")


def test_a_job_that_is_ended_is_told(panel: Panel) -> None:
    panel.start("6110")
    # It is ended before the tools have begun, by the same thread.
    panel.page.evaluate("play.endsAll = true")
    panel.button("Read all").click()
    expect(panel.state).to_have_text("ended")
    expect(panel.state).to_have_class(re.compile("wrong"))
    panel.page.evaluate("play.endsAll = false")
    panel.type("maximum current", "5")
    expect(panel.row("maximum current")).to_contain_text("changed")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1400, 360])
def test_nothing_is_in_the_way(plain_chromium: Browser, hosted: Site, scheme: str, width: int) -> None:
    context = plain_chromium.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page = context.new_page()
    page.goto(hosted.url)
    panel = Panel(page)
    panel.start()
    panel.page.get_by_label("Bank").select_option("all")
    panel.page.get_by_label("Shown in").select_option("own")
    panel.type("maximum current", "300")
    panel.type("standby current", "9")
    panel.choose("mine.tmcl", FILE)
    expect(panel.import_).to_be_visible()
    panel.button("Note: maximum acceleration").click()
    found = Axe().run(page).response["violations"]
    assert [f"{one['id']}: {one['nodes'][0]['html'][:200]}" for one in found] == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    expect(panel.table.get_by_role("columnheader")).to_have_count(8)
    for name in ("Store: maximum current", "Favourite: maximum current"):
        box = panel.button(name).bounding_box()
        assert box
        # For fingers, or for a mouse.
        assert min(box["width"], box["height"]) >= (44 if width < 1100 else 24), name


def test_by_keyboard_alone(panel: Panel) -> None:
    panel.start()
    keyboard = panel.page.keyboard

    def tab_to(locator: Locator) -> None:
        for _ in range(400):
            keyboard.press("Tab")
            if locator.evaluate("element => element === document.activeElement"):
                return
        raise AssertionError(locator)

    tab_to(panel.button("Favourite: maximum current"))
    keyboard.press("Space")
    expect(panel.button("Favourite: maximum current")).to_have_attribute("aria-pressed", "true")
    tab_to(panel.input("maximum current"))
    keyboard.press("Control+A")
    keyboard.type("66")
    keyboard.press("Enter")
    expect(panel.row("maximum current")).to_contain_text("changed, was 128")
    tab_to(panel.button("Store: maximum current"))
    keyboard.press("Enter")
    expect(panel.page.get_by_role("dialog")).to_be_visible()
    keyboard.press("Escape")
    expect(panel.page.get_by_role("dialog")).to_have_count(0)
    assert panel.value("GAP 6, 0") == 66
