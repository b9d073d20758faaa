"""The workbench as a whole: what it keeps, what is in the way, and where its parts are."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from bed.browser import Browser
from bed.server import Site
from playwright.sync_api import Page, expect
from studio import Studio


@pytest.fixture
def studio(plain_chromium: Browser, studio_site: Site) -> Studio:
    return Studio(plain_chromium.open(studio_site.url))


def again(studio: Studio) -> Studio:
    """The page, loaded anew."""
    studio.page.reload()
    return Studio(studio.page)


def test_texts_lines_and_curves_are_kept(studio: Studio) -> None:
    studio.start()
    studio.program("// mine\nSTOP\n")
    studio.send("GAP 1, 0")
    curve = studio.page.get_by_role("combobox", name="Curve")
    curve.fill("rotor")
    curve.press("Enter")
    expect(studio.button("Remove: rotor")).to_be_visible()
    studio = again(studio)
    expect(studio.page.get_by_role("textbox", name="Program")).to_have_value("// mine\nSTOP\n")
    studio.line.press("ArrowUp")
    expect(studio.line).to_have_value("GAP 1, 0")
    studio.start()
    expect(studio.button("Remove: rotor")).to_be_visible()
    assert studio.send("GAP 1, 0").startswith("GAP 1, 0: 0 "), (
        "what was in the memory of the virtual module is not kept"
    )


def test_two_tabs_do_not_overwrite_each_others_texts(plain_chromium: Browser, studio_site: Site) -> None:
    first, second = (Studio(plain_chromium.open(studio_site.url)) for _ in range(2))
    first.program("// first\n")
    # What a tab keeps comes to the others a moment later.
    while "// first" not in second.page.evaluate("localStorage.getItem('tmcl-studio/text/program.tmc') ?? ''"):
        second.page.wait_for_timeout(20)
    second.program("// second\n")
    expect(second.page.get_by_role("status", name="Loading")).to_contain_text("another tab")
    texts = second.page.get_by_role("combobox", name="Text", exact=True)
    expect(texts).to_have_value("program-2.tmc")
    expect(second.page.get_by_role("textbox", name="Program")).to_have_value("// second\n")
    texts.select_option("program.tmc")
    expect(second.page.get_by_role("textbox", name="Program")).to_have_value("// first\n")


def test_everything_is_a_file_or_forgotten(studio: Studio) -> None:
    studio.program("// mine\n")
    with studio.page.expect_download() as got:
        studio.button("Everything as a file").click()
    file = Path(got.value.path())
    kept = json.loads(file.read_text())
    assert kept["studio"] == 1
    assert kept["kept"]["text/program.tmc"]["text"] == "// mine\n"
    studio.button("Forget everything").click()
    with studio.page.expect_navigation():
        studio.page.get_by_role("dialog").get_by_role("button", name="Forget").click()
    studio = Studio(studio.page)
    text = studio.page.get_by_role("textbox", name="Program")
    expect(text).not_to_have_value("// mine\n")
    assert studio.page.evaluate("localStorage.length") == 1, "nothing but which text is shown"
    studio.program("// other\n")
    open_everything(studio, file)
    with studio.page.expect_navigation():
        studio.page.get_by_role("dialog").get_by_role("button", name="Open").click()
    studio = Studio(studio.page)
    names = studio.page.get_by_role("combobox", name="Text", exact=True)
    expect(names.get_by_role("option")).to_have_text(["program-2.tmc", "program.tmc"])
    expect(text).to_have_value("// other\n")
    names.select_option("program-2.tmc")
    expect(text).to_have_value("// mine\n")


def open_everything(studio: Studio, file: Path) -> None:
    """Chooses a file of all that was kept."""
    with studio.page.expect_file_chooser() as chooser:
        studio.button("Open everything").click()
    chooser.value.set_files(file)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is cut off"),
        ('{"studio":1,"kept":{', "is cut off"),
        ('{"name":"x"}', "no file of this page"),
        ('{"studio":1,"kept":[]}', "no file of this page"),
        ('{"studio":2,"kept":{}}', "of a later version of this page (2); this one reads up to 1"),
        (
            json.dumps({"studio": 1, "kept": {"text/a.tmc": {"version": 1, "text": "x" * 1_900_000}}}),
            "has no room for it",
        ),
    ],
)
def test_a_file_that_cannot_be_kept_changes_nothing(studio: Studio, tmp_path: Path, text: str, words: str) -> None:
    studio.program("// mine\n")
    file = tmp_path / "kept.json"
    file.write_text(text)
    fill = "localStorage.setItem('tmcl-studio/filled', JSON.stringify('x'.repeat(4_000_000)))"
    if "room" in words:
        studio.page.evaluate(fill)
    open_everything(studio, file)
    if "room" in words:
        studio.page.get_by_role("dialog").get_by_role("button", name="Open").click()
    expect(studio.page.get_by_role("status", name="What is kept")).to_contain_text(words)
    assert "// mine" in studio.page.evaluate("localStorage.getItem('tmcl-studio/text/program.tmc')")
    assert studio.page.evaluate("localStorage.getItem('tmcl-studio/text/a.tmc')") is None
    studio.start()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("STAP 4, 0", "The value of maximum positioning speed that is stored in the EEPROM"),
        ("7, 4, 0, 0", "The value of maximum positioning speed that is stored in the EEPROM"),
        ("STGP 3, 2", "The value of user variable 3 that is stored in the EEPROM"),
        ("SGP 66, 0, 5", "The module may not answer any more over this link"),
        ("SCO 0, 255, 0", "The coordinates that are stored"),
        ("137, 0, 0, 1234", "All settings that are stored"),
    ],
)
def test_what_would_be_lost_is_asked_about(studio: Studio, line: str, words: str) -> None:
    studio.start()
    studio.line.fill(line)
    studio.line.press("Enter")
    dialog = studio.page.get_by_role("dialog")
    expect(dialog).to_contain_text(words)
    dialog.get_by_role("button", name="Cancel").click()
    expect(studio.line).to_have_value(line)
    assert studio.send("GAP 1, 0").endswith("status 100 ok")
    expect(studio.replies).to_have_count(1)
    studio.line.fill(line)
    studio.line.press("Enter")
    dialog.get_by_role("button", name="Send").click()
    expect(studio.replies).to_have_count(2)


@pytest.mark.parametrize(
    "edited", ["", "{", "5", "[]", '{"version":"x","text":5}', '{"version":-1,"text":"x"}', "null"]
)
def test_what_is_kept_may_be_edited_by_hand(studio: Studio, edited: str) -> None:
    names = ["text/program.tmc", "text shown", "curves", "history", "scope", "parameters"]
    for name in names:
        studio.page.evaluate("([name, text]) => localStorage.setItem(`tmcl-studio/${name}`, text)", [name, edited])
    # What goes keeps something itself.
    studio.page.evaluate("() => addEventListener('pagehide', event => event.stopImmediatePropagation(), true)")
    studio = again(studio)
    studio.start()
    assert studio.send("GAP 1, 0").endswith("status 100 ok")
    expect(studio.page.get_by_role("textbox", name="Program")).to_be_visible()


def test_where_the_browser_keeps_nothing_the_page_says_so(plain_chromium: Browser, studio_site: Site) -> None:
    context = plain_chromium.new_context()
    context.add_init_script("Storage.prototype.setItem = () => { throw new Error('the storage is full'); }")
    page = context.new_page()
    page.goto(studio_site.url)
    studio = Studio(page)
    expect(page.get_by_text("keeps nothing for the next visit: the storage is full")).to_be_visible()
    studio.program("// mine\n")
    expect(page.get_by_role("status", name="Loading")).to_contain_text("save it as a file")
    studio.start()


def test_the_log_has_all_telegrams(plain_chromium: Browser, studio_site: Site) -> None:
    studio = Studio(plain_chromium.open(studio_site.url))
    studio.start()
    studio.page.get_by_text("Telegrams", exact=True).click()
    studio.send("SAP 4, 0, 777")
    log = studio.page.get_by_role("region", name="Telegrams").get_by_role("listitem")
    request = log.filter(has_text=">  01 05 04 00 00 00 03 09 16   to 1: SAP 4, 0, 777")
    expect(request).to_have_count(1)
    expect(log.filter(has_text="status 100 ok").last).to_be_visible()
    with studio.page.expect_download() as got:
        studio.button("Save").click()
    assert "to 1: SAP 4, 0, 777" in Path(got.value.path()).read_text()


def test_proposals_come_from_the_tables(studio: Studio) -> None:
    studio.start()
    studio.line.press_sequentially("GAP APActualP")
    proposal = studio.page.get_by_role("group", name="Proposals").get_by_role("button", name="APActualPosition")
    proposal.click()
    expect(studio.line).to_have_value("GAP APActualPosition")
    studio.line.press_sequentially(", 0")
    studio.line.press("Enter")
    expect(studio.replies).to_contain_text("GAP 1, 0: 0 microsteps (actual position), status 100 ok")


def shown(page: Page) -> list[str]:
    """The headings of the parts that are seen."""
    return [heading.inner_text() for heading in page.get_by_role("heading", level=2).all() if heading.is_visible()]


def test_a_wide_window_shows_all_and_a_narrow_one_a_part(plain_chromium: Browser, studio_site: Site) -> None:
    context = plain_chromium.new_context(viewport={"width": 1400, "height": 900})
    page = context.new_page()
    page.goto(studio_site.url)
    studio = Studio(page)
    studio.start("6110")
    assert {"Module", "Axes", "Parameters", "Inputs and outputs", "Scope", "Program", "Direct mode"} <= set(shown(page))
    page.set_viewport_size({"width": 360, "height": 640})
    assert shown(page) == ["Module", "Jobs"]
    for part in ("Scope", "Program", "Parameters", "Direct mode"):
        studio.button(part).click()
        assert part in shown(page)
        expect(studio.button("STOP")).to_be_in_viewport()
        assert page.evaluate("document.documentElement.scrollWidth") <= 360, part


def test_curves_of_a_virtual_module_have_a_row_each_millisecond(studio: Studio) -> None:
    studio.start("6110")
    expect(studio.page.get_by_text(" rows a second")).to_be_visible()
    curve = studio.page.get_by_role("combobox", name="Curve")
    for name in ("rotor 5", "GAP 207, 5"):
        curve.fill(name)
        curve.press("Enter")
    expect(studio.page.locator("#curves").get_by_role("list")).to_contain_text("reading it clears it")
    curve.fill("roter")
    curve.press("Enter")
    expect(studio.page.get_by_role("status", name="Curve")).to_contain_text("did you mean 'rotor'?")
    studio.control("pause")
    studio.control("step 500 ms")
    with studio.page.expect_download() as got:
        studio.page.get_by_role("button", name="CSV of all rows").click()
    rows = Path(got.value.path()).read_text().splitlines()[1:]
    times = [float(row.split(",")[0]) for row in rows]
    assert len(times) > 500
    assert all(later - earlier == 1 for earlier, later in zip(times[-500:], times[-499:], strict=False))


def test_inputs_outputs_and_axes_of_the_largest_module(studio: Studio) -> None:
    """What the world does is told in words, and what is switched is read back and seen in the world."""
    studio.start("6110")
    page = studio.page
    words = page.get_by_role("list", name="Axis 5 in words").get_by_role("listitem")
    expect(words.filter(has_text="at position")).to_have_count(1)
    studio.send("SAP 13, 5, 0")
    studio.control("press left 5")
    expect(studio.row("Limit and home switches", "left limit switch of axis 5")).to_contain_text("closed")
    studio.send("ROL 5, 500")
    expect(words.filter(has_text="left limit switch is closed")).to_have_count(1)
    output = page.get_by_role("switch", name="OUT7")
    output.click()
    expect(output).to_have_attribute("aria-checked", "true")
    assert studio.send("GIO 7, 2").startswith("GIO 7, 2: 1,")
    output.click()
    expect(output).to_have_attribute("aria-checked", "false")
    assert studio.send("GIO 7, 2").startswith("GIO 7, 2: 0,")


def test_twelve_curves_of_all_axes_and_no_more(studio: Studio) -> None:
    studio.start("6110")
    curve = studio.page.get_by_role("combobox", name="Curve")
    shown = studio.page.locator("#curves").get_by_role("listitem")
    names = [f"rotor {axis}" for axis in range(6)] + [f"GAP 4, {axis}" for axis in range(6)]
    # The usual ones come first.
    expect(shown).to_have_count(2)
    for index, name in enumerate(names[:10]):
        curve.fill(name)
        curve.press("Enter")
        expect(shown).to_have_count(3 + index)
    curve.fill("GGP 132, 0")
    curve.press("Enter")
    expect(studio.page.get_by_role("status", name="Curve")).to_contain_text("12")
    expect(shown).to_have_count(12)


def test_stop_is_in_reach_while_something_is_asked(studio: Studio) -> None:
    studio.start()
    studio.send("ROR 0, 300")
    studio.line.fill("STAP 4, 0")
    studio.line.press("Enter")
    dialog = studio.page.get_by_role("dialog")
    dialog.get_by_role("button", name="STOP").click()
    expect(dialog).to_have_count(0)
    expect(studio.page.get_by_role("status", name="Announced")).to_have_text("stopped")
    assert studio.send("GAP 2, 0").startswith("GAP 2, 0: 0 int")
    expect(studio.replies.filter(has_text="STAP")).to_have_count(0)


def test_stop_stays_where_it_is(studio: Studio) -> None:
    """Whatever is told beside it."""
    for width in (1400, 360):
        studio.page.set_viewport_size({"width": width, "height": 800})
        before = studio.button("STOP").bounding_box()
        studio.page.get_by_role("status", name="Link").evaluate("link => link.textContent = 'many words '.repeat(30)")
        assert studio.button("STOP").bounding_box() == before
        studio.page.get_by_role("status", name="Link").evaluate("link => link.textContent = 'ready'")


def test_choices_are_kept_at_once(studio: Studio) -> None:
    """And not when the page goes: it may be killed."""
    studio.start()
    studio.is_read()
    studio.button("Favourite: maximum current").click()
    studio.page.get_by_role("combobox", name="Window").select_option(label="1 min")
    with studio.page.expect_download() as got:
        studio.button("Everything as a file").click()
    kept = json.loads(Path(got.value.path()).read_text())["kept"]
    assert kept["parameters"]["favourites"] == ["axis/6"]
    assert kept["scope"]["window"] == 60_000


def test_curves_belong_to_their_product(studio: Studio) -> None:
    studio.start("6110")
    curve = studio.page.get_by_role("combobox", name="Curve")
    shown = studio.page.locator("#curves").get_by_role("listitem")
    expect(shown).to_have_count(2)
    curve.fill("rotor 5")
    curve.press("Enter")
    expect(shown).to_have_count(3)
    curve.fill("GAP 1, 9")
    curve.press("Enter")
    told = studio.page.get_by_role("status", name="Curve")
    expect(told).to_have_text("'GAP 1, 9': this module has no axis 9, but axes 0 to 5")
    curve.fill("Axis 3: actual speed 3")
    curve.press("Enter")
    expect(shown).to_have_count(4)
    expect(told).to_have_text("")
    studio.start("1140")
    expect(shown).to_have_count(2)
    studio.start("6110")
    expect(shown).to_have_count(4)


def test_a_module_without_power_shows_no_values(studio: Studio) -> None:
    studio.start()
    studio.send("SAP 6, 0, 77")
    studio.is_read()
    position = studio.row("Axes", "actual position (microsteps)")
    expect(position).to_have_text("0")
    studio.control("power off")
    expect(position).to_have_text("-")
    studio.control("power on")
    expect(position).to_have_text("0")
    current = studio.page.get_by_role("textbox", name="maximum current", exact=True)
    expect(current).to_have_value("128")
    expect(studio.link).to_have_text("connected")


def test_leaving_a_field_writes_nothing(studio: Studio) -> None:
    """A value of a parameter may move a motor."""
    studio.start()
    studio.is_read()
    target = studio.page.get_by_role("textbox", name="target position", exact=True)
    target.fill("20000")
    target.press("Tab")
    expect(studio.page.get_by_text("not written: Enter writes it, Esc takes it back")).to_be_visible()
    assert studio.send("GAP 0, 0").startswith("GAP 0, 0: 0 ")
    target.press("Enter")
    expect(studio.row("Axes", "actual position (microsteps)")).to_have_text("20000")
