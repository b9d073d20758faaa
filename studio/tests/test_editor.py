"""The editor, in a page of its own. What it knows of a language comes from stand-ins here, and the language is none."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from bed.browser import Browser, until
from bed.server import Site
from playwright.sync_api import Locator, Page, expect

EDITOR = Path(__file__).parents[1] / "page" / "editor"

PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>An editor</title><link rel="icon" href="data:,">
<meta http-equiv="Content-Security-Policy"
    content="default-src 'none'; script-src 'self'; style-src 'self'; img-src data:">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="stylesheet" href="style.css"><link rel="stylesheet" href="editor/editor.css">
<main><h1>An editor</h1><div id="root"></div><button id="after">After it</button></main>
<script type="module" src="editor.mjs"></script></html>
"""


class Bench:
    """An open page with an editor."""

    def __init__(self, page: Page):
        self.page = page
        self.until("window.editor !== undefined")
        self.area = page.get_by_role("textbox", name="Program")
        self.list = page.get_by_role("listbox", name="Completions")
        self.options = self.list.get_by_role("option")
        self.status = page.get_by_role("status", name="Explanation")
        self.messages = page.get_by_role("list", name="Messages").get_by_role("listitem")
        self.lines = page.locator(".editor-line:not([hidden])")

    def set(self, text: str) -> None:
        """Another text, that has been checked."""
        self.page.evaluate("text => editor.setText(text)", text)
        self.checked()

    def checked(self) -> None:
        """Waits until the text has been checked as it is now, and that is shown."""
        self.until("asked.at(-1) === (editor.text.length < 1000 ? editor.text : editor.text.length)")
        self.until("!editor.checks.isAsked")
        # What is to be drawn in the next frame is drawn before the one after that.
        self.page.evaluate("new Promise((next) => requestAnimationFrame(() => requestAnimationFrame(next)))")

    def until(self, condition: str) -> None:
        """Waits until that is so."""
        until(self.page, condition)

    @property
    def text(self) -> str:
        """The text."""
        text: str = self.page.evaluate("editor.text")
        assert text == self.area.input_value()
        return text

    def told(self, what: str) -> Any:
        """What the editor has told so far."""
        return self.page.evaluate("what => told[what]", what)

    def parts(self, line: int) -> list[tuple[str, str]]:
        """The parts of a line in view that have a kind."""
        spans = self.lines.nth(line).locator("span[class*=editor-is]").all()
        return [(span.get_attribute("class") or "", span.text_content() or "") for span in spans]

    def caret(self, line: int, column: int) -> None:
        """Puts the caret at a place."""
        self.page.evaluate("([line, column]) => editor.goto(line, column)", [line, column])

    def button(self, name: str) -> Locator:
        """A button by its whole name."""
        return self.page.get_by_role("button", name=name, exact=True)

    def place(self) -> list[int]:
        """Start and end of what is selected."""
        place: list[int] = self.area.evaluate("area => [area.selectionStart, area.selectionEnd]")
        return place


def write(site: Site) -> None:
    """Writes the page."""
    shutil.copytree(EDITOR, site.folder / "editor")
    shutil.copy(EDITOR.parent / "dom.js", site.folder)
    shutil.copy(EDITOR.parent / "style.css", site.folder)
    shutil.copy(Path(__file__).parent / "editor.mjs", site.folder)
    site.write(index__html=PAGE)


@pytest.fixture
def bench(plain: Browser, site: Site) -> Bench:
    """The editor, in either browser."""
    write(site)
    return Bench(plain.open(site.url))


@pytest.fixture
def in_chromium(plain_chromium: Browser, site: Site) -> Bench:
    """The editor, where one browser is enough."""
    write(site)
    return Bench(plain_chromium.open(site.url))


def test_what_is_typed_is_coloured_after_a_pause(bench: Bench) -> None:
    bench.area.click()
    bench.page.keyboard.type("MOVE speed 12 # fast\nSTOP")
    bench.checked()
    assert bench.text == "MOVE speed 12 # fast\nSTOP"
    expected = [("mnemonic", "MOVE"), ("name", "speed"), ("number", "12"), ("comment", "# fast")]
    assert bench.parts(0) == [(f"editor-is-{kind}", text) for kind, text in expected]
    assert bench.parts(1) == [("editor-is-mnemonic", "STOP")]
    assert bench.told("changes") == 25


def test_colours_are_where_the_text_is(bench: Bench) -> None:
    """The text area tells which letter is at a point: that at which the layer has a word."""
    lines = [
        "\tMOVE\t12",
        "Gr\u00f6\u00dfe\tMOVE",
        "\U0001f600\U0001f680 MOVE \U0001f600 12",
        "  \t MOVE",
        "",
        "\u4e2d\u6587 MOVE 7",
    ]
    text = "\r\n".join(lines)
    bench.area.focus()
    bench.page.evaluate(
        "text => document.execCommand('insertText', false, text)",
        text.replace("\r\n", "\n") if bench.page.evaluate("navigator.userAgent.includes('Firefox')") else text,
    )
    bench.checked()
    assert bench.text == "\n".join(lines)
    found = bench.page.evaluate(
        r"""() => [...document.querySelectorAll('.editor-line:not([hidden])')].flatMap((line) =>
            [...line.querySelectorAll('[class*=editor-is]')].map((span) => {
                const { left, top, height } = span.getBoundingClientRect();
                const place = document.caretPositionFromPoint(left + 1, top + height / 2);
                const word = editor.text.slice(place.offset).startsWith(span.textContent);
                return [span.textContent, place.offsetNode === editor.area, word];
            }))"""
    )
    assert len(found) == 13
    assert all(in_area and word for _, in_area, word in found), found
    assert bench.parts(2)[2] == ("editor-is-mnemonic", "MOVE")


def test_what_scrolls_stays_together(bench: Bench) -> None:
    bench.set("\n".join(f"MOVE {line} {'x' * 300} STOP" for line in range(500)))
    bench.caret(399, 308)
    for line in (399,):
        at = bench.page.evaluate(
            """line => {
                const shown = [...document.querySelectorAll('.editor-line:not([hidden])')];
                const span = shown.find((one) => one.textContent.startsWith(`MOVE ${line} `)).lastChild;
                const { left, top, height } = span.getBoundingClientRect();
                const { offset } = document.caretPositionFromPoint(left + 1, top + height / 2);
                return [span.textContent, offset, left < innerWidth];
            }""",
            line,
        )
        assert at == ["STOP", bench.text.index("STOP", bench.text.index("MOVE 399 ")), True]
    expect(bench.button("Breakpoint at line 400")).to_be_in_viewport()


def test_a_changed_line_is_plain_until_it_is_checked(bench: Bench) -> None:
    bench.set("MOVE 1\nMOVE 2\nMOVE 3")
    bench.page.evaluate("window.held = []")
    bench.caret(1, 6)
    bench.page.keyboard.type("2")
    expect(bench.lines.nth(1)).to_have_text("MOVE 22")
    assert bench.parts(1) == []
    assert len(bench.parts(0)) == len(bench.parts(2)) == 2


def test_an_old_answer_is_dropped(bench: Bench) -> None:
    bench.set("")
    bench.page.evaluate("window.held = []")
    bench.area.focus()
    bench.page.keyboard.type("MOVE")
    bench.until("asked.at(-1) === 'MOVE'")
    bench.page.keyboard.type(" bad")
    # As after the pause; but one question is asked at a time.
    bench.page.evaluate("void editor.check()")
    assert bench.page.evaluate("[asked.at(-1), held.length]") == ["MOVE", 1]
    bench.page.evaluate("held.shift()()")
    bench.until("held.length === 1")
    assert bench.page.evaluate("asked.at(-1)") == "MOVE bad"
    expect(bench.lines.nth(0)).to_have_text("MOVE bad")
    assert bench.parts(0) == []
    expect(bench.button("Breakpoint at line 1")).to_have_count(0)
    bench.page.evaluate("held.shift()()")
    expect(bench.messages).to_have_count(1)
    assert bench.parts(0) == [("editor-is-mnemonic", "MOVE"), ("editor-is-wrong editor-is-error", "bad")]


def test_of_a_large_text_only_what_is_seen_is_drawn(bench: Bench) -> None:
    line = "MOVE 12345 speed # a comment\n"
    text = line * (2 * 1024 * 1024 // len(line))
    bench.set(text)
    count = bench.page.locator("*").count()
    assert count < 800
    middle = len(text.splitlines()) // 2
    bench.caret(middle, 4)
    bench.page.evaluate(
        """window.drawn = new Set();
        const draw = ({ target }) => drawn.add(target.closest?.('.editor-line'));
        new MutationObserver((changes) => changes.forEach(draw)).observe(
            document.querySelector('.editor-lines'), { childList: true, subtree: true, characterData: true });"""
    )
    bench.page.keyboard.type("X")
    shown = bench.lines.filter(has_text="MOVEX")
    expect(shown).to_have_count(1)
    assert bench.page.evaluate("drawn.size") == 1, "one line has changed"
    expect(shown).to_be_in_viewport()
    bench.checked()
    assert abs(bench.page.locator("*").count() - count) < 20
    assert bench.text == text[: middle * len(line) + 4] + "X" + text[middle * len(line) + 4 :]
    bench.page.keyboard.press("Control+End")
    expect(bench.button(f"Breakpoint at line {len(text.splitlines())}")).to_be_in_viewport()


def test_a_line_too_long_to_be_drawn_is_shown_by_the_text_area(bench: Bench) -> None:
    bench.set("MOVE " + "x" * 2 * 1024 * 1024)
    fill = "area => getComputedStyle(area).webkitTextFillColor"
    assert bench.area.evaluate(fill) != "rgba(0, 0, 0, 0)"
    assert bench.lines.first.text_content() == ""
    bench.set("MOVE")
    assert bench.area.evaluate(fill) == "rgba(0, 0, 0, 0)"


def test_messages_lead_to_their_places(bench: Bench) -> None:
    bench.set("\n" * 200 + "MOVE bad\nodd\nfar")
    expect(bench.messages).to_have_count(3)
    bench.button("line 201: error: unknown name 'bad'").click()
    expect(bench.area).to_be_focused()
    assert bench.place() == [205, 208]
    expect(bench.lines.filter(has_text="MOVE bad")).to_be_in_viewport()
    bench.page.keyboard.press("Home")
    bench.page.keyboard.press("Enter")
    expect(bench.messages).to_have_count(3)
    bench.checked()
    warning = bench.messages.nth(1)
    expect(warning).to_contain_text("line 203: warning: an odd <b>name</b>")
    expect(warning).to_contain_text("use an even one")
    bench.button("far.inc, line 8: error: wrong there").click()
    assert bench.told("files") == [["far.inc", 7, 3]]
    assert bench.told("announced") == ["2 errors, 1 warning"]
    assert bench.page.locator("b, i").count() == 0, "text is no HTML"


def test_a_message_moves_with_the_text_before_it_is_checked(bench: Bench) -> None:
    bench.set("MOVE\nbad")
    bench.page.evaluate("window.held = []")
    bench.caret(0, 0)
    bench.page.keyboard.type("\n\n")
    bench.button("Use 'good'").click()
    assert bench.text == "\n\nMOVE\ngood"
    expect(bench.area).to_be_focused()
    # Its place has been edited: it does nothing any more.
    bench.button("Use 'good'").click()
    assert bench.text == "\n\nMOVE\ngood"


def test_advice_is_taken_and_undone(bench: Bench) -> None:
    bench.set("STOP\nMOVE bad 12")
    bench.button("Use 'good'").click()
    assert bench.text == "STOP\nMOVE good 12"
    expect(bench.messages).to_have_count(0)
    assert bench.told("announced") == ["1 error", "no errors"]
    bench.page.keyboard.press("Control+z")
    assert bench.text == "STOP\nMOVE bad 12"
    expect(bench.messages).to_have_count(1)
    expect(bench.lines.nth(1)).to_have_text("MOVE bad 12")


def test_completion_by_keyboard(bench: Bench) -> None:
    bench.set("")
    bench.area.focus()
    bench.page.keyboard.type("MO")
    expect(bench.list).to_be_visible()
    line = bench.lines.first.bounding_box()
    place = bench.list.bounding_box()
    assert line
    assert place
    assert place["y"] == line["y"] + line["height"]
    expect(bench.options).to_have_text(["MOVE about MOVE", "MOVEALL about MOVEALL", "MOTOR about MOTOR"])
    expect(bench.area).not_to_have_attribute("aria-activedescendant", "")
    bench.page.keyboard.press("ArrowDown")
    bench.page.keyboard.press("ArrowDown")
    chosen = bench.list.get_by_role("option", selected=True)
    expect(chosen).to_have_text("MOVEALL about MOVEALL")
    assert bench.area.get_attribute("aria-activedescendant") == chosen.get_attribute("id")
    assert bench.area.get_attribute("aria-controls") == bench.list.get_attribute("id")
    bench.page.keyboard.press("Enter")
    assert bench.text == "MOVEALL"
    expect(bench.list).to_be_hidden()
    bench.page.keyboard.press("Control+z")
    assert bench.text == "MO"
    bench.page.keyboard.press("Control+Space")
    expect(chosen).to_have_text("MOVE about MOVE")
    bench.page.keyboard.press("ArrowUp")
    expect(chosen).to_have_text("MOTOR about MOTOR")
    bench.page.keyboard.type("V")
    expect(bench.options).to_have_count(2)
    bench.page.keyboard.press("Enter")
    assert bench.text == "MOVE"
    assert "3 completions" in bench.told("announced")


def test_enter_is_a_new_line_as_long_as_nothing_is_chosen(bench: Bench) -> None:
    bench.set("")
    bench.area.focus()
    bench.page.keyboard.type("MOV")
    expect(bench.options).to_have_count(2)
    bench.page.keyboard.press("Enter")
    assert bench.text == "MOV\n"
    expect(bench.list).to_be_hidden()


def test_completion_by_pointer_and_its_end(bench: Bench) -> None:
    bench.set("")
    bench.area.click()
    bench.page.keyboard.type("ST")
    bench.options.first.click()
    assert bench.text == "STOP"
    expect(bench.area).to_be_focused()
    bench.page.keyboard.type(" MO")
    expect(bench.options).to_have_count(3)
    bench.page.keyboard.press("ArrowLeft")
    expect(bench.list).to_be_hidden()
    bench.page.keyboard.press("Control+Space")
    expect(bench.options).to_have_count(3)
    bench.page.keyboard.press("Control+Home")
    expect(bench.list).to_be_hidden()


def test_escape_closes_the_list_and_reaches_the_document(bench: Bench) -> None:
    bench.set("")
    bench.area.focus()
    bench.page.keyboard.type("MO")
    expect(bench.options).to_have_count(3)
    bench.page.keyboard.press("Escape")
    expect(bench.list).to_be_hidden()
    assert bench.told("escapes") == 1
    assert bench.text == "MO"


def test_tab_leaves(bench: Bench) -> None:
    bench.set("MOVE\nSTOP\n")
    bench.area.focus()
    bench.page.keyboard.press("Control+End")
    bench.page.keyboard.type("MO")
    expect(bench.options).to_have_count(3)
    bench.page.keyboard.press("Tab")
    expect(bench.button("After it")).to_be_focused()
    expect(bench.list).to_be_hidden()
    bench.page.keyboard.press("Shift+Tab")
    expect(bench.area).to_be_focused()
    bench.page.keyboard.press("Shift+Tab")
    # All buttons of the margin are one stop.
    expect(bench.button("Breakpoint at line 1")).to_be_focused()
    bench.page.keyboard.press("Shift+Tab")
    expect(bench.page.locator(".editor :focus")).to_have_count(0)
    assert bench.text == "MOVE\nSTOP\nMO"


def test_breakpoints_by_pointer_and_by_key(bench: Bench) -> None:
    bench.set("MOVE\n# nothing\nSTOP")
    expect(bench.page.get_by_role("group", name="Breakpoints").get_by_role("button")).to_have_count(2)
    first = bench.button("Breakpoint at line 1")
    first.click()
    expect(first).to_have_attribute("aria-pressed", "true")
    bench.caret(2, 0)
    bench.page.keyboard.press("F9")
    expect(bench.button("Breakpoint at line 3")).to_have_attribute("aria-pressed", "true")
    bench.page.keyboard.press("ArrowUp")
    bench.page.keyboard.press("F9")
    first.click()
    assert bench.told("breakpoints") == [[0, True], [2, True], [0, False]]
    expect(bench.status).to_have_text("Line 2 has no command")
    assert bench.told("announced") == ["Breakpoint at line 3 set"]
    assert bench.page.evaluate("editor.breakpointLines") == [2]
    bench.page.evaluate("editor.breakpoints([0])")
    expect(first).to_have_attribute("aria-pressed", "true")
    expect(bench.button("Breakpoint at line 3")).to_have_attribute("aria-pressed", "false")


def test_arrow_keys_go_from_breakpoint_to_breakpoint(bench: Bench) -> None:
    bench.set("MOVE" + "\n" * 300 + "STOP")
    bench.button("Breakpoint at line 1").focus()
    bench.page.keyboard.press("ArrowDown")
    last = bench.button("Breakpoint at line 301")
    expect(last).to_be_focused()
    expect(last).to_be_in_viewport()
    bench.page.keyboard.press("Space")
    assert bench.told("breakpoints") == [[300, True]]
    bench.page.evaluate("editor.area.scrollTop = 0")
    expect(bench.area).to_be_focused()


@pytest.mark.parametrize(
    ("line", "column", "keys", "expected"),
    [
        (0, 0, ["Enter"], [2, 4]),
        (1, 0, ["Enter"], [2, 4]),
        (1, 4, ["Enter"], [1, 4]),
        (1, 0, ["Backspace"], [0, 2]),
        (3, 4, ["Enter", "S", "T"], [1, 3]),
        (1, 0, ["Delete"], [1, 3]),
        (1, 0, ["Shift+ArrowDown", "Delete"], [2]),
        (1, 0, ["Shift+End", "X"], [1, 3]),
        (0, 0, ["Control+a", "X"], []),
        (2, 0, ["Shift+ArrowDown", "Shift+ArrowDown", "Delete"], [1]),
    ],
)
def test_breakpoints_move_with_their_lines(
    in_chromium: Bench, line: int, column: int, keys: list[str], expected: list[int]
) -> None:
    bench = in_chromium
    bench.set("MOVE\nMOVE\nMOVE\nMOVE\nMOVE")
    bench.page.evaluate("editor.breakpoints([1, 3]); editor.current(3)")
    bench.caret(line, column)
    for key in keys:
        bench.page.keyboard.press(key)
    assert bench.page.evaluate("editor.breakpointLines") == expected
    moved = bench.told("moved")
    assert moved[-1:] == ([] if expected == [1, 3] else [expected])


def test_the_current_line_is_shown(bench: Bench) -> None:
    bench.set("MOVE\n" * 300)
    bench.page.evaluate("editor.current(250)")
    button = bench.button("Breakpoint at line 251")
    expect(button).to_have_attribute("aria-current", "step")
    expect(button).to_be_in_viewport()
    assert bench.page.locator(".editor-line.editor-current").count() == 1
    assert not bench.area.evaluate("area => area === document.activeElement"), "the focus stays where it is"
    bench.page.evaluate("editor.current(null)")
    expect(bench.page.locator("[aria-current]")).to_have_count(0)


def test_words_are_explained(bench: Bench) -> None:
    bench.set("MOVE here 12\nfar\nhere it is")
    bench.caret(0, 6)
    bench.page.keyboard.press("Control+i")
    expect(bench.status).to_have_text("here is a <i>word</i>")
    bench.button("Go to line 3").click()
    expect(bench.area).to_be_focused()
    assert bench.place() == [18, 18]
    bench.caret(1, 0)
    bench.page.keyboard.press("F12")
    expect(bench.status).to_have_text("far is a <i>word</i>")
    assert bench.told("files") == [["far.inc", 4, 5]]
    expect(bench.button("Go to far.inc, line 5")).to_be_visible()
    bench.caret(0, 12)
    bench.page.keyboard.press("Control+i")
    expect(bench.status).to_have_text("There is nothing to explain here")
    bench.page.keyboard.type("!")
    expect(bench.status).to_have_text("")


def test_a_word_under_a_pointer_that_rests_is_explained(bench: Bench) -> None:
    bench.set("12 here\nMOVE")
    bench.lines.nth(0).locator("span", has_text="here").hover(force=True)
    expect(bench.status).to_have_text("here is a <i>word</i>")
    bench.lines.nth(1).locator("span").hover(force=True)
    expect(bench.status).to_have_text("MOVE is a <i>word</i>")


def test_a_service_that_fails_is_told(bench: Bench) -> None:
    bench.area.click()
    bench.page.keyboard.type("fail")
    expect(bench.status).to_have_text("the tools have ended")
    bench.page.keyboard.type(" 12")
    bench.checked()
    assert bench.parts(0)[-1] == ("editor-is-number", "12")


def test_undo_is_the_browsers(bench: Bench) -> None:
    """What is typed at once is undone at once, though the layer and the list have changed meanwhile."""
    bench.set("MOVE")
    bench.caret(0, 4)
    for key in " MOV x 12":
        bench.page.keyboard.type(key)
        bench.page.evaluate("new Promise(requestAnimationFrame)")
    assert bench.text == "MOVE MOV x 12"
    bench.page.keyboard.press("Control+z")
    assert bench.text == "MOVE"
    bench.page.keyboard.press("Control+Shift+z")
    assert bench.text == "MOVE MOV x 12"
    bench.checked()
    expect(bench.lines.first.locator("span.editor-is-number")).to_have_text("12")


def test_what_an_input_method_composes_is_shown(in_chromium: Bench) -> None:
    bench = in_chromium
    bench.set("# ")
    bench.caret(0, 2)
    session = bench.page.context.new_cdp_session(bench.page)
    session.send("Input.imeSetComposition", {"text": "\u306b\u307b", "selectionStart": 2, "selectionEnd": 2})
    expect(bench.lines.first).to_have_text("# \u306b\u307b")
    session.send("Input.insertText", {"text": "\u65e5\u672c"})
    expect(bench.lines.first).to_have_text("# \u65e5\u672c")
    assert bench.text == "# \u65e5\u672c"
    bench.checked()
    assert bench.parts(0) == [("editor-is-comment", "# \u65e5\u672c")]


def test_text_is_no_html(bench: Bench) -> None:
    bench.set("<img src=x onerror=alert(1)> bad odd")
    bench.caret(0, 2)
    bench.page.keyboard.press("Control+i")
    expect(bench.status).to_have_text("img is a <i>word</i>")
    expect(bench.lines.first).to_have_text("<img src=x onerror=alert(1)> bad odd")
    assert bench.page.locator("img, i, b").count() == 0


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1400])
def test_it_fits_and_can_be_read(plain_chromium: Browser, site: Site, scheme: Any, width: int) -> None:
    write(site)
    context = plain_chromium.new_context(viewport={"width": width, "height": 640}, color_scheme=scheme, has_touch=True)
    page = context.new_page()
    page.goto(site.url)
    bench = Bench(page)
    bench.set("MOVE here bad 12 # why\nodd\n" + "x" * 400)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.evaluate("editor.current(0)")
    bench.button("Breakpoint at line 1").tap()
    assert bench.told("breakpoints") == [[0, True]]
    bench.lines.first.locator("span", has_text="here").tap(force=True)
    expect(bench.status).to_have_text("here is a <i>word</i>")
    bench.caret(1, 3)
    page.keyboard.type(" MO")
    bench.options.nth(2).tap()
    assert bench.text.splitlines()[1] == "odd MOTOR"
    colours = page.evaluate(
        """[...document.querySelectorAll('.editor-line, .editor-line span, .editor-keys, .editor-row')].map((one) => {
            let behind = one;
            while (getComputedStyle(behind).backgroundColor === 'rgba(0, 0, 0, 0)') behind = behind.parentElement;
            return [getComputedStyle(one).color, getComputedStyle(behind).backgroundColor];
        })"""
    )
    assert len(colours) > 10
    for fore, behind in set(map(tuple, colours)):
        assert contrast(fore, behind) >= 4.5, (fore, behind)


def contrast(one: str, other: str) -> float:
    """The contrast of two colours `rgb(r, g, b)`, as WCAG defines it."""

    def luminance(colour: str) -> float:
        parts = [int(part) / 255 for part in colour.removeprefix("rgb(").removesuffix(")").split(",")]
        red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    dark, light = sorted([luminance(one), luminance(other)])
    return (light + 0.05) / (dark + 0.05)


def test_forced_colours_show_the_text_itself(plain_chromium: Browser, site: Site) -> None:
    write(site)
    page = plain_chromium.new_context(forced_colors="active").new_page()
    page.goto(site.url)
    bench = Bench(page)
    bench.set("MOVE bad")
    style = bench.area.evaluate("area => [getComputedStyle(area).webkitTextFillColor, getComputedStyle(area).color]")
    assert style[0] == style[1] != "rgba(0, 0, 0, 0)"
    assert page.locator(".editor-lines").evaluate("layer => getComputedStyle(layer).visibility") == "hidden"
    bench.caret(0, 0)
    page.keyboard.press("F9")
    expect(bench.button("Breakpoint at line 1")).to_have_attribute("aria-pressed", "true")
    bench.caret(0, 8)
    page.keyboard.type(" MO")
    left = bench.list.evaluate("list => list.offsetLeft")
    assert left > 50, "the list is where the word is, which the layer knows"


def test_nothing_moves_by_itself(in_chromium: Bench) -> None:
    """There is nothing for prefers-reduced-motion to end."""
    in_chromium.set("MOVE\n" * 300)
    assert in_chromium.page.evaluate("editor.current(200); document.getAnimations().length") == 0
    style = "[...document.querySelectorAll('.editor *')].map((one) => getComputedStyle(one))"
    assert in_chromium.page.evaluate(f"{style}.every((style) => style.scrollBehavior === 'auto')")
    expect(in_chromium.button("Breakpoint at line 201")).to_be_in_viewport()


def test_every_control_has_a_role_and_a_name(in_chromium: Bench) -> None:
    in_chromium.set("MOVE bad\nSTOP")
    in_chromium.caret(1, 4)
    in_chromium.page.keyboard.type(" MO")
    expect(in_chromium.options).to_have_count(3)
    session = in_chromium.page.context.new_cdp_session(in_chromium.page)
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    seen = [(node["role"]["value"], node["name"]["value"]) for node in nodes if not node["ignored"] and "name" in node]
    for expected in [
        ("textbox", "Program"),
        ("group", "Breakpoints"),
        ("button", "Breakpoint at line 2"),
        ("listbox", "Completions"),
        ("list", "Messages"),
        ("status", "Explanation"),
        ("button", "Use 'good'"),
    ]:
        assert expected in seen
    controls = {"button", "textbox", "listbox", "option"}
    assert all(name for role, name in seen if role in controls)
    expect(in_chromium.page.locator(".editor-layer[inert][aria-hidden=true]")).to_have_count(1)
