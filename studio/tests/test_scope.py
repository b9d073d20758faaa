"""The scope by its front door: rows that are fed, and what is seen of them."""

from __future__ import annotations

import csv
import io
import re
import shutil
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import Any

import pytest
from bed.browser import Browser, until
from bed.module import ROOT
from bed.server import Site
from playwright.sync_api import Locator, Page, expect

PAGE = ROOT / "studio" / "page"
HTML = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Scope</title><link rel="icon" href="data:,">
<meta http-equiv="Content-Security-Policy"
content="default-src 'none'; script-src 'self'; style-src 'self'; img-src data:">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="stylesheet" href="style.css"><link rel="stylesheet" href="scope/scope.css"></head>
<body><main><section></section></main><script type="module" src="test.js"></script></body></html>"""
# Notes all large buffers that are made from now on.
WATCH = """globalThis.made = [];
for (const name of ['Int8Array', 'Uint8Array', 'Uint8ClampedArray', 'Int16Array', 'Uint16Array', 'Int32Array',
    'Uint32Array', 'Float32Array', 'Float64Array', 'BigInt64Array', 'BigUint64Array', 'ArrayBuffer']) {
    globalThis[name] = new Proxy(globalThis[name], { construct(target, given) {
        const buffer = Reflect.construct(target, given);
        if (buffer.byteLength >= 1000) { made.push(buffer.byteLength); }
        return buffer;
    } });
}"""
# The values of all curves, of all rows.
VALUES = """panel.curves.map((_, curve) => Array.from({ length: panel.rings.next },
    (_, row) => panel.rings.value(curve, row) ?? null))"""
SCRIPT = """import './watch.js';
import { ScopePanel } from './scope/panel.js';
globalThis.files = [];
globalThis.announced = [];
globalThis.changes = 0;
globalThis.panel = new ScopePanel(document.querySelector('section'), {
    download: (name, text, type) => files.push({ name, text, type }),
    announce: (text) => announced.push(text),
    changed: () => { changes += 1; },
});"""
# Rows of so many curves from a time on, each millisecond one; curve c has the value (time + 1) * (c + 1) modulo 1000.
FEED = """([from, to, curves]) => {
    for (let start = from; start < to; start += 1000) {
        const rows = [];
        for (let at = start; at < Math.min(start + 1000, to); at += 1) {
            rows.push({ at, values: Array.from({ length: curves }, (_, curve) => ((at + 1) * (curve + 1)) % 1000) });
        }
        panel.rows(rows);
    }
}"""
# Two frames of the browser later all that was asked for is drawn.
DRAWN = "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(panel.figures()))))"
POSITION = {"name": "position 0", "unit": "microsteps", "decimals": 0, "note": ""}
SPEED = {"name": "speed 0", "unit": "rpm", "decimals": 1, "note": ""}
LOAD = {"name": 'load, "0"', "unit": "", "decimals": 3, "note": "reading it clears it"}


class Scope:
    """A page with nothing but a scope."""

    def __init__(self, page: Page):
        self.page = page
        self.plot = page.get_by_role("application", name="Plot")
        self.table = page.get_by_role("table", name="Values at the cursors")
        self.seen = page.locator(".scope-seen")
        self.message = page.get_by_role("status", name="Scope")
        self.trigger = page.locator(".scope-trigger-state")
        expect(self.plot).to_be_visible()

    def button(self, name: str) -> Locator:
        """A button by its whole name."""
        return self.page.get_by_role("button", name=name, exact=True)

    def cursor(self, name: str) -> Locator:
        """The handle of a cursor."""
        return self.page.get_by_role("slider", name=f"Cursor {name}")

    def columns(self, *columns: dict[str, Any]) -> None:
        """Begins anew with these curves."""
        self.page.evaluate("list => panel.columns(list)", columns)

    def rows(self, *rows: tuple[float, Sequence[float | None]]) -> None:
        """Feeds rows."""
        self.page.evaluate("list => panel.rows(list)", [{"at": at, "values": values} for at, values in rows])

    def feed(self, start: int, end: int, curves: int = 1) -> None:
        """Feeds a row for each millisecond."""
        self.page.evaluate(FEED, [start, end, curves])

    def figures(self) -> dict[str, int]:
        """What was counted when all is drawn."""
        figures: dict[str, int] = self.page.evaluate(DRAWN)
        return figures

    def pixels(self) -> str:
        """The picture on the canvas."""
        self.figures()
        picture: str = self.plot.locator("canvas").evaluate("canvas => canvas.toDataURL()")
        return picture

    def values(self, curve: str) -> list[str]:
        """The line of a curve in the table of the cursors."""
        row = self.table.get_by_role("row").filter(has=self.page.get_by_role("rowheader", name=curve, exact=True))
        return row.get_by_role("cell").all_inner_texts()

    def file(self) -> dict[str, str]:
        """The last file that was given."""
        self.wait("files.length > 0")
        file: dict[str, str] = self.page.evaluate("files.pop()")
        return file

    def wait(self, condition: str) -> None:
        """Waits for a condition."""
        until(self.page, condition)

    def state(self) -> dict[str, Any]:
        """What is kept."""
        state: dict[str, Any] = self.page.evaluate("panel.state()")
        return state

    def x(self, place: float) -> float:
        """Where a place of the view is, from 0 (left) to 1 (right), in pixels from the left of the plot."""
        box = self.plot.bounding_box()
        assert box is not None
        return 80 + place * (box["width"] - 2 - 88)


@pytest.fixture
def place(site: Site) -> str:
    """The address of a page with a scope."""
    shutil.copytree(PAGE / "scope", site.folder / "scope")
    shutil.copy(PAGE / "dom.js", site.folder)
    shutil.copy(PAGE / "style.css", site.folder)
    site.write(index__html=HTML, watch__js=WATCH, test__js=SCRIPT)
    return site.url


@pytest.fixture
def scope(plain_chromium: Browser, place: str) -> Scope:
    """A scope in Chromium."""
    return Scope(plain_chromium.open(place))


def test_cursors_tell_values_and_their_difference(scope: Scope) -> None:
    scope.columns(POSITION, SPEED, LOAD)
    scope.rows(*((10 * row, [row, row / 10 - 3, None if row == 700 else 0.001]) for row in range(1001)))
    scope.plot.click(position={"x": scope.x(0.25), "y": 100})
    scope.plot.click(position={"x": scope.x(0.75), "y": 100})
    first, second = (int(scope.cursor(name).get_attribute("aria-valuenow") or "") // 10 for name in "AB")
    assert abs(first - 250) <= 2
    assert abs(second - 750) <= 2
    assert scope.values("position 0 (microsteps)") == [str(first), str(second), str(second - first)]
    assert scope.values("speed 0 (rpm)") == [f"{one / 10 - 3:.1f}" for one in (first, second)] + [
        f"{(second - first) / 10:.1f}"
    ]
    assert scope.values("Time")[2] == f"{(second - first) / 100:.3f} s"
    # To the row whose load is missing.
    scope.cursor("B").focus()
    while int(scope.cursor("B").get_attribute("aria-valuenow") or "") > 7000:
        scope.page.keyboard.press("Shift+ArrowLeft")
        scope.figures()
    assert scope.values('load, "0"') == ["0.001", "\N{EN DASH}", ""]
    assert scope.values("position 0 (microsteps)")[1] == "700"
    assert scope.table.get_attribute("aria-live") is None


def test_cursors_are_dragged_and_removed(scope: Scope) -> None:
    scope.columns(POSITION)
    scope.feed(0, 10_001)
    scope.button("Cursor A").click()
    box = scope.plot.bounding_box()
    assert box is not None
    before = int(scope.cursor("A").get_attribute("aria-valuenow") or "")
    scope.page.mouse.move(box["x"] + 1 + scope.x(1 / 3), box["y"] + 100)
    scope.page.mouse.down()
    scope.page.mouse.move(box["x"] + 1 + scope.x(0.5), box["y"] + 100, steps=4)
    scope.page.mouse.up()
    scope.figures()
    after = int(scope.cursor("A").get_attribute("aria-valuenow") or "")
    assert before < 3400 < 4950 <= after <= 5050
    assert scope.values("position 0 (microsteps)")[0] == str((after + 1) % 1000)
    expect(scope.seen).to_have_text("Seen: 0.000 s to 10.000 s, live")
    scope.cursor("A").press("Delete")
    expect(scope.cursor("A")).to_be_hidden()
    assert scope.values("Time") == ["", "", ""]


@pytest.mark.parametrize("edge", ["rising", "falling"])
def test_a_single_trigger_puts_the_view_and_pauses(scope: Scope, edge: str) -> None:
    scope.columns(SPEED)
    form = scope.page.locator(".scope-trigger")
    form.locator("summary").click()
    form.get_by_label("Single").check()
    form.get_by_label("Level").fill("20.5")
    form.get_by_label("Edge").select_option(edge)
    form.get_by_label("Trigger curve").select_option("speed 0")
    expect(scope.trigger).to_have_text("armed")
    # A triangle between 0 and 40: it rises over 20.5 at 210 ms and each 800 ms later, and falls at 600 ms.
    rows = [(10.0 * row, [abs((row + 40) % 80 - 40)]) for row in range(1000)]
    scope.rows(*rows[:15])
    expect(scope.trigger).to_have_text("armed")
    scope.rows(*rows[15:])
    fired = {"rising": 0.210, "falling": 0.600}[edge]
    expect(scope.trigger).to_have_text(f"fired at {fired:.3f} s")
    # A quarter of the window is before it.
    expect(scope.seen).to_have_text(f"Seen: {fired - 2.5:.3f} s to {fired + 7.5:.3f} s, paused")
    assert scope.page.evaluate("announced") == [f"Trigger: fired at {fired:.3f} s"]
    scope.rows((20_000, [0]), (20_010, [40]), (20_020, [0]))
    expect(scope.trigger).to_have_text(f"fired at {fired:.3f} s")
    form.get_by_role("button", name="Arm").click()
    expect(scope.trigger).to_have_text("armed")
    expect(scope.seen).to_contain_text("live")


def test_a_trigger_fires_again_when_its_view_is_full(scope: Scope) -> None:
    scope.columns(POSITION)
    scope.page.get_by_label("Window").select_option("2 s")
    state = scope.state() | {
        "trigger": {"curve": "position 0", "edge": "rising", "level": 500, "single": False},
    }
    assert scope.page.evaluate("state => panel.restore(state)", state) == ""
    # Up to 500 at 499, 1499, 2499: in the view of the first one, which ends at 1999, is the second one, too.
    scope.feed(0, 1600)
    expect(scope.seen).to_have_text("Seen: -0.001 s to 1.999 s, put by the trigger")
    scope.feed(1600, 2400)
    expect(scope.seen).to_have_text("Seen: -0.001 s to 1.999 s, put by the trigger")
    scope.feed(2400, 2600)
    expect(scope.seen).to_have_text("Seen: 1.999 s to 3.999 s, put by the trigger")
    expect(scope.trigger).to_have_text("fired at 2.499 s, armed")
    scope.button("Pause").click()
    scope.feed(2600, 8000)
    expect(scope.seen).to_have_text("Seen: 1.999 s to 3.999 s, paused")
    expect(scope.trigger).to_have_text("fired at 2.499 s, armed, but the view is paused")
    assert scope.page.evaluate("announced") == []


def test_what_is_paused_or_panned_stands_still_while_rows_come(scope: Scope) -> None:
    scope.columns(POSITION, SPEED)
    scope.feed(0, 20_001, 2)
    expect(scope.seen).to_have_text("Seen: 10.000 s to 20.000 s, live")
    scope.button("Pause").click()
    before = scope.pixels()
    frames = scope.figures()["frames"]
    scope.feed(20_001, 25_001, 2)
    assert scope.pixels() == before
    assert scope.figures()["frames"] == frames, "nothing has changed, so nothing is drawn"
    scope.button("Earlier").click()
    expect(scope.seen).to_have_text("Seen: 9.000 s to 19.000 s, paused")
    panned = scope.pixels()
    assert panned != before
    scope.feed(25_001, 30_001, 2)
    assert scope.pixels() == panned
    scope.button("Live").click()
    expect(scope.seen).to_have_text("Seen: 20.000 s to 30.000 s, live")
    scope.feed(30_001, 31_001, 2)
    expect(scope.seen).to_have_text("Seen: 21.000 s to 31.000 s, live")


def test_the_mouse_pans_and_zooms(scope: Scope) -> None:
    scope.columns(POSITION)
    scope.feed(0, 30_001)
    box = scope.plot.bounding_box()
    assert box is not None
    scope.page.mouse.move(box["x"] + 1 + scope.x(0.2), box["y"] + 50)
    scope.page.mouse.wheel(0, 100)
    expect(scope.seen).to_have_text("Seen: 20.000 s to 30.000 s, live")
    scope.page.mouse.down()
    scope.page.mouse.move(box["x"] + 1 + scope.x(0.7), box["y"] + 50, steps=5)
    scope.page.mouse.up()
    scope.figures()
    expect(scope.seen).to_have_text(re.compile(r"Seen: 1[45]\.\d+ s to 2[45]\.\d+ s, paused"))
    start, end = map(float, re.findall(r"[\d.]+(?= s)", scope.seen.inner_text()))
    assert abs(start - 15) < 0.05
    expect(scope.cursor("A")).to_be_hidden()
    # Where the pointer is, the time stays.
    scope.page.mouse.wheel(0, -100)
    expect(scope.seen).not_to_have_text(re.compile(f"Seen: {start:.3f}"))
    zoomed = list(map(float, re.findall(r"[\d.]+(?= s)", scope.seen.inner_text())))
    assert abs(zoomed[1] - zoomed[0] - 8) < 0.002
    assert abs((start + 0.7 * (end - start)) - (zoomed[0] + 0.7 * 8)) < 0.05
    expect(scope.page.get_by_label("Window")).to_have_value("8000")
    scope.page.keyboard.down("Shift")
    scope.page.mouse.wheel(0, 100)
    expect(scope.seen).to_contain_text(f"{zoomed[0] + 0.8:.3f} s to")


def test_two_fingers_zoom(plain_chromium: Browser, place: str) -> None:
    context = plain_chromium.new_context(viewport={"width": 360, "height": 740}, has_touch=True)
    page = context.new_page()
    page.goto(place)
    scope = Scope(page)
    scope.columns(POSITION)
    scope.feed(0, 30_001)
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    scope.button("Pause").tap()
    scope.plot.scroll_into_view_if_needed()
    box = scope.plot.bounding_box()
    assert box is not None
    session = context.new_cdp_session(page)

    def touch(kind: str, *places: float) -> None:
        points = [
            {"x": box["x"] + 1 + scope.x(one), "y": box["y"] + 60, "id": finger} for finger, one in enumerate(places)
        ]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 0.4)
    touch("touchStart", 0.4, 0.6)
    for step in range(1, 5):
        touch("touchMove", 0.4 - 0.05 * step, 0.6 + 0.05 * step)
    touch("touchEnd")
    scope.figures()
    # The fingers are three times as far from each other as they were.
    start, end = map(float, re.findall(r"[\d.]+(?= s)", scope.seen.inner_text()))
    assert abs((end - start) - 10 / 3) < 0.3
    assert abs((end + start) / 2 - 25) < 0.3


def test_by_keyboard_alone(scope: Scope) -> None:
    scope.columns(POSITION)
    scope.feed(0, 30_001)
    scope.plot.focus()
    for key, seen in (
        ("ArrowLeft", "Seen: 19.000 s to 29.000 s, paused"),
        ("Shift+ArrowLeft", "Seen: 9.000 s to 19.000 s, paused"),
        ("ArrowRight", "Seen: 10.000 s to 20.000 s, paused"),
        ("+", "Seen: 11.000 s to 19.000 s, paused"),
        ("-", "Seen: 10.000 s to 20.000 s, paused"),
        ("End", "Seen: 20.000 s to 30.000 s, live"),
        ("Space", "Seen: 20.000 s to 30.000 s, paused"),
        ("Space", "Seen: 20.000 s to 30.000 s, live"),
        ("Home", "Seen: -9.000 s to 1.000 s, paused"),
        ("End", "Seen: 20.000 s to 30.000 s, live"),
    ):
        scope.page.keyboard.press(key)
        expect(scope.seen).to_have_text(seen)
    scope.button("Cursor A").focus()
    scope.page.keyboard.press("Enter")
    expect(scope.cursor("A")).to_have_attribute("aria-valuetext", "23.333 s")
    scope.cursor("A").focus()
    for key, time in (
        ("Shift+ArrowRight", "23.334 s"),
        ("PageUp", "24.334 s"),
        ("PageDown", "23.334 s"),
        ("Home", "20.000 s"),
        ("End", "30.000 s"),
        ("ArrowRight", "30.000 s"),
        ("Shift+ArrowLeft", "29.999 s"),
    ):
        scope.page.keyboard.press(key)
        expect(scope.cursor("A")).to_have_attribute("aria-valuetext", time)
    step = 10_000 / scope.figures()["columns"]
    scope.page.keyboard.press("ArrowLeft")
    scope.figures()
    assert abs(29_999 - step - int(scope.cursor("A").get_attribute("aria-valuenow") or "")) <= 1
    expect(scope.seen).to_contain_text("live")


@pytest.mark.parametrize(("width", "ratio"), [(1400, 1), (360, 1), (777, 1.5)])
def test_a_frame_looks_at_four_values_a_curve_and_column_at_most(
    plain_chromium: Browser, place: str, width: int, ratio: float
) -> None:
    context = plain_chromium.new_context(viewport={"width": width, "height": 800}, device_scale_factor=ratio)
    page = context.new_page()
    page.goto(place)
    scope = Scope(page)
    scope.columns(*(POSITION | {"name": f"position {axis}"} for axis in range(8)))
    scope.feed(0, 600_000, 8)
    counts = {}
    for window in ("1 s", "10 s", "1 min", "10 min"):
        page.get_by_label("Window").select_option(window)
        counts[window] = count_of_frame(scope)
    # Any window between.
    for _ in range(12):
        scope.button("Zoom in").click()
        counts[page.get_by_label("Window").input_value()] = count_of_frame(scope)
    scope.button("Earlier").click()
    counts["panned"] = count_of_frame(scope)
    assert all(0 < count <= 4 for count in counts.values()), counts
    assert counts["10 min"] >= 2, "the least and the greatest value of each column at least"


def count_of_frame(scope: Scope) -> float:
    """Values a curve and column."""
    figures = scope.figures()
    assert figures["curves"] == 8
    return figures["looked"] / figures["curves"] / figures["columns"]


def test_buffers_are_allocated_once(scope: Scope) -> None:
    bytes_ = scope.figures()["bytes"]
    made = scope.page.evaluate("made")
    assert sum(made) == bytes_ <= 64_000_000
    scope.columns(*(POSITION | {"name": f"position {axis}", "unit": f"unit {axis}"} for axis in range(12)))
    # More than there is room for.
    scope.feed(0, 700_000, 12)
    for window in ("1 s", "10 min"):
        scope.page.get_by_label("Window").select_option(window)
        scope.figures()
    scope.columns(POSITION)
    scope.feed(0, 1000)
    scope.figures()
    assert scope.page.evaluate("made") == made
    assert scope.figures()["bytes"] == bytes_


@pytest.mark.parametrize(("even", "late"), [(True, 1), (False, 12)])
def test_no_value_is_left_out_of_a_picture(scope: Scope, even: bool, late: int) -> None:
    """Each of 600 000 rows is seen in its pixel column, or the next one; where the rows become fewer, a few later."""
    odd = scope.page.evaluate(
        """async ([even, late]) => {
            const { ROWS, Rings } = await import('./scope/rings.js');
            const { Frame } = await import('./scope/frame.js');
            const [rings, frame] = [new Rings(), new Frame()];
            rings.begin([0]);
            for (let row = 0, at = 0; row < ROWS + 12345; row += 1) {
                // Or slow, fast, and with gaps.
                at += even ? 1 : row % 50_000 < 2000 ? 7 : row % 99_999 === 0 ? 5000 : 0.5;
                // By its limits a column tells which rows it has.
                rings.push(at, [row]);
            }
            const odd = [];
            for (const columns of [16, 333, 701, 1400, 2048]) {
                for (const part of [1, 0.31, 0.01, 0.0013]) {
                    const to = rings.newest - (1 - part) * 30_000;
                    const from = to - part * (rings.newest - rings.oldest);
                    const before = rings.looked;
                    frame.look(rings, { from, to }, columns, [0]);
                    if (rings.looked - before > 4 * columns) {
                        odd.push({ columns, part, looked: rings.looked - before });
                    }
                    let column = 0;
                    for (let row = rings.rowAt(from); row < rings.rowAfter(to); row += 1) {
                        while (frame.edges[column + 1] <= row) { column += 1; }
                        let place = column;
                        while (place < columns && !(frame.least[place] <= row && row <= frame.greatest[place])) {
                            place += 1;
                        }
                        if (place === columns || place > column + late) {
                            odd.push({ columns, part, row, column, place });
                        }
                    }
                }
            }
            return odd.slice(0, 10);
        }""",
        [even, late],
    )
    assert odd == []


def test_csv_has_all_rows_or_those_in_view(scope: Scope) -> None:
    scope.columns(POSITION, SPEED, LOAD)
    rows = [(float(row), [-(2**31) + row, None if row % 3 else row / 10, row / 1000]) for row in range(30_000)]
    scope.rows(*rows)
    scope.button("CSV of all rows").click()
    file = scope.file()
    assert (file["name"], file["type"]) == ("scope.csv", "text/csv")
    assert file["text"].count("\r\n") == file["text"].count("\n") == 30_001
    assert file["text"].startswith('time (ms),position 0 (microsteps),speed 0 (rpm),"load, ""0"""\r\n')
    expected = [
        [str(row), str(-(2**31) + row), "" if row % 3 else f"{row / 10:.1f}", f"{row / 1000:.3f}"]
        for row in range(30_000)
    ]
    assert list(csv.reader(io.StringIO(file["text"], newline="")))[1:] == expected
    scope.button("CSV of the view").click()
    assert list(csv.reader(io.StringIO(scope.file()["text"], newline="")))[1:] == expected[19_999:]


def test_curves_that_stay_keep_their_rows(scope: Scope) -> None:
    """Whatever becomes of others, and also while nothing moves."""
    scope.columns(POSITION, SPEED, LOAD)
    scope.feed(0, 3000, 3)
    scope.button("Pause").click()
    before = scope.page.evaluate(VALUES)
    scope.columns(POSITION, LOAD)
    assert scope.page.evaluate(VALUES) == [before[0], before[2]]
    expect(scope.seen).to_contain_text("paused")
    scope.columns(POSITION, LOAD, SPEED)
    assert scope.page.evaluate(VALUES) == [before[0], before[2], [None] * 3000]
    scope.feed(3000, 3010, 3)
    after = scope.page.evaluate(VALUES)
    assert after[0][:3000] == before[0]
    assert None not in after[2][3000:]
    scope.pixels()
    scope.columns(SPEED)
    assert scope.page.evaluate(VALUES) == [after[2]]
    scope.columns(LOAD | {"name": "another"})
    assert scope.page.evaluate("panel.rings.next") == 0


def test_values_that_do_not_fit_are_missing(scope: Scope) -> None:
    scope.columns(POSITION, SPEED)
    scope.rows((0.5, [2**31 - 1, 2**31 - 1]), (1, [2**31, -(2**31) / 10]), (1, [0.4, -0.04]))
    scope.button("CSV of all rows").click()
    assert scope.file()["text"].splitlines()[1:] == ["0.5,2147483647,", "1,,-214748364.8", "1,0,0.0"]


def test_svg_is_what_is_seen_and_asks_for_nothing(scope: Scope) -> None:
    scope.columns(POSITION, SPEED, LOAD | {"name": "<load> & \u0001"})
    scope.feed(0, 20_000, 3)
    scope.button("Cursor A").click()
    scope.button("SVG of the view").click()
    file = scope.file()
    assert (file["name"], file["type"]) == ("scope.svg", "image/svg+xml")
    root = ET.fromstring(file["text"])
    names = {element.tag.removeprefix("{http://www.w3.org/2000/svg}") for element in root.iter()}
    assert names <= {"svg", "title", "rect", "path", "text"}
    assert not re.search(r"href|url\(|style=|font-face|<script|NaN|Infinity", file["text"])
    texts = {element.text for element in root.iter("{http://www.w3.org/2000/svg}text")}
    assert {"microsteps", "rpm", "no unit", "time in s", "A", "position 0 (microsteps)", "<load> & \ufffd"} <= texts
    times = {int(text) for text in texts if text and text.isdigit() and 10 <= int(text) <= 20}
    assert 10 in times
    assert len(times) > 2, "the times of the view"
    # The browser draws it.
    loaded = scope.page.evaluate(
        """text => new Promise(done => {
            const image = new Image();
            image.onload = () => done(image.naturalWidth);
            image.onerror = () => done(0);
            image.src = 'data:image/svg+xml,' + encodeURIComponent(text);
        })""",
        file["text"],
    )
    assert loaded == scope.plot.evaluate("plot => plot.clientWidth")
    scope.button("position 0 (microsteps)").click()
    scope.button("SVG of the view").click()
    assert "microsteps" not in scope.file()["text"]


def test_curves_of_one_unit_share_a_scale(scope: Scope) -> None:
    scope.columns(POSITION, SPEED | {"name": "speed 1", "decimals": 0}, SPEED)
    scope.rows((0, [5, 100, 3.5]), (1000, [6, 200, 7.5]))
    form = scope.page.locator(".scope-scales")
    form.locator("summary").click()
    assert form.get_by_role("group").count() == 2
    speeds = form.get_by_role("group", name="rpm")
    speeds.get_by_label("Automatic").uncheck()
    low, high = speeds.get_by_label("Lowest"), speeds.get_by_label("Highest")
    assert float(low.input_value()) <= 3.5
    assert 200 <= float(high.input_value()) < 300
    before = scope.pixels()
    high.fill("1000")
    high.press("Enter")
    assert scope.pixels() != before
    kept = [{"unit": "rpm", "low": float(low.input_value()), "high": 1000}]
    assert scope.state()["scales"] == kept
    high.fill("-1000")
    high.press("Enter")
    assert high.evaluate("input => input.validationMessage") == "The highest value must be above the lowest."
    assert scope.state()["scales"] == kept
    speeds.get_by_label("Automatic").check()
    assert scope.state()["scales"] == []
    assert scope.pixels() == before


def test_a_missing_value_interrupts_its_curve(scope: Scope) -> None:
    scope.page.get_by_label("Window").select_option("1 s")
    paths = []
    for middle in (5, None):
        scope.columns(POSITION)
        scope.rows((0, [1]), (250, [2]), (500, [middle]), (750, [2]), (1000, [1]))
        scope.figures()
        scope.button("SVG of the view").click()
        curve = ET.fromstring(scope.file()["text"]).findall(
            "{http://www.w3.org/2000/svg}svg/{http://www.w3.org/2000/svg}path"
        )[0]
        paths.append(curve.attrib["d"].count("M"))
    assert paths == [1, 2]


def test_curves_are_told_by_more_than_colour(scope: Scope) -> None:
    scope.columns(*(POSITION | {"name": f"curve {number}"} for number in range(12)))
    scope.figures()
    samples = scope.page.evaluate(
        """() => {
            // Without colours: whatever is not the background is black.
            return [...document.querySelectorAll('.scope-sample')].map((canvas) => {
                const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
                let text = '';
                for (let at = 0; at < data.length; at += 4) {
                    const same = [0, 1, 2].every((one) => Math.abs(data[at + one] - data[one]) < 60);
                    text += same ? ' ' : '#';
                }
                return text;
            });
        }"""
    )
    assert len(samples) == len(set(samples)) == 12


def test_the_legend_hides_curves_and_tells_notes(scope: Scope) -> None:
    scope.columns(POSITION, LOAD)
    scope.feed(0, 1000, 2)
    expect(scope.page.get_by_role("list", name="Curves")).to_contain_text("reading it clears it")
    entry = scope.button("position 0 (microsteps)")
    expect(entry).to_have_attribute("aria-pressed", "true")
    before = scope.pixels()
    entry.press("Enter")
    expect(entry).to_have_attribute("aria-pressed", "false")
    assert scope.pixels() != before
    assert scope.figures()["curves"] == 1
    assert scope.state()["hidden"] == ["position 0"]
    assert scope.page.evaluate("changes") == 1


def test_what_is_kept_comes_back(scope: Scope, place: str) -> None:
    state = {
        "window": 12_500,
        "scales": [{"unit": "rpm", "low": -5.5, "high": 5}],
        "trigger": {"curve": "speed 9", "edge": "falling", "level": -1.5, "single": True},
        "hidden": ["speed 0"],
    }
    assert scope.page.evaluate("state => panel.restore(state)", state) == ""
    assert scope.state() == state
    scope.columns(POSITION, SPEED)
    assert scope.state() == state, "the next curves do not change it"
    expect(scope.button("speed 0 (rpm)")).to_have_attribute("aria-pressed", "false")
    expect(scope.page.get_by_label("Window")).to_have_value("12500")
    expect(scope.page.get_by_label("Window").locator("option:checked")).to_have_text("12.5 s")
    expect(scope.trigger).to_have_text("waits for a curve of the name speed 9")
    scope.page.evaluate("kept => { kept.hidden.push('x'); }", state)
    assert scope.page.evaluate("() => { panel.state().hidden.push('x'); return panel.state(); }") == state


GOOD: dict[str, Any] = {
    "window": 10_000,
    "scales": [],
    "trigger": {"curve": "", "edge": "rising", "level": 0, "single": False},
    "hidden": [],
}


@pytest.mark.parametrize(
    ("state", "what"),
    [
        (None, ""),
        ("scope", ""),
        ([], "window"),
        ({}, "window"),
        (GOOD | {"more": 1}, ""),
        (GOOD | {"window": "10000"}, "window"),
        (GOOD | {"window": 0}, "window"),
        (GOOD | {"window": 1e300}, "window"),
        (GOOD | {"scales": {}}, "scales"),
        (GOOD | {"scales": [{"unit": "rpm", "low": 1, "high": 1}]}, "scales"),
        (GOOD | {"scales": [{"unit": "rpm", "low": -1.7e308, "high": 1.7e308}]}, "scales"),
        (GOOD | {"scales": [{"unit": "rpm", "low": 0, "high": 1}] * 2}, "scales"),
        (GOOD | {"trigger": None}, "trigger"),
        (GOOD | {"trigger": GOOD["trigger"] | {"edge": "both"}}, "trigger"),
        (GOOD | {"trigger": GOOD["trigger"] | {"level": None}}, "trigger"),
        (GOOD | {"hidden": ["x" * 201]}, "hidden"),
        (GOOD | {"hidden": [7]}, "hidden"),
        (GOOD | {"hidden": [str(number) for number in range(101)]}, "hidden"),
    ],
)
def test_what_was_edited_by_hand_is_told_and_not_used(scope: Scope, state: object, what: str) -> None:
    scope.columns(POSITION)
    before = scope.state()
    told = scope.page.evaluate("state => panel.restore(state)", state)
    assert told == f"what was kept of the scope is not right{f' ({what})' if what else ''}, and is not used"
    expect(scope.message).to_have_text(told)
    assert scope.state() == before
    scope.columns(POSITION)
    expect(scope.message).to_have_text(told)
    scope.feed(0, 1000)
    expect(scope.seen).to_have_text("Seen: -9.001 s to 0.999 s, live")


def test_a_time_that_begins_anew_begins_the_curves_anew(scope: Scope) -> None:
    scope.columns(POSITION)
    scope.feed(5000, 9000)
    scope.rows((1, [1]), (2, [2]))
    expect(scope.message).to_have_text("the time of the module has begun anew, and so have the curves")
    expect(scope.seen).to_have_text("Seen: -9.998 s to 0.002 s, live")
    scope.button("CSV of all rows").click()
    assert scope.file()["text"].splitlines()[1:] == ["1,1", "2,2"]


def test_rate_and_missing_rows_are_shown(scope: Scope) -> None:
    scope.page.evaluate("panel.rate('13 rows a second')")
    scope.page.evaluate("panel.lost(2)")
    scope.page.evaluate("panel.lost(3)")
    expect(scope.page.get_by_text("13 rows a second")).to_be_visible()
    expect(scope.page.get_by_text("5 rows are missing")).to_be_visible()
    scope.columns(POSITION)
    expect(scope.page.get_by_text("rows are missing")).to_have_count(0)
    scope.columns(*(POSITION | {"name": str(number)} for number in range(13)))
    expect(scope.message).to_have_text("only the first 12 of 13 curves are shown")


def test_what_a_hidden_panel_does_not_draw_is_not_lost(scope: Scope) -> None:
    scope.columns(POSITION)
    scope.page.evaluate("document.querySelector('section').hidden = true")
    frames = scope.figures()["frames"]
    scope.feed(0, 5000)
    assert scope.figures()["frames"] == frames
    scope.page.evaluate("document.querySelector('section').hidden = false")
    expect(scope.seen).to_have_text("Seen: -5.001 s to 4.999 s, live")
    scope.wait(f"panel.figures().frames > {frames}")
    assert scope.figures()["looked"] > 0


def test_where_nothing_is_to_move_the_view_goes_on_in_steps(plain_chromium: Browser, place: str) -> None:
    page = plain_chromium.new_context(reduced_motion="reduce").new_page()
    page.goto(place)
    scope = Scope(page)
    scope.columns(POSITION)
    scope.feed(0, 1001)
    seen = []
    for end in range(1001, 2001, 50):
        scope.feed(end, end + 50)
        scope.figures()
        seen.append(scope.seen.inner_text())
    assert len(set(seen)) == 4, "four times a second"
    page.emulate_media(reduced_motion="no-preference")
    expect(scope.seen).to_have_text("Seen: -8.000 s to 2.000 s, live")
    scope.feed(2001, 2102)
    expect(scope.seen).to_have_text("Seen: -7.899 s to 2.101 s, live")


def test_it_is_drawn_anew_in_other_colours_and_sizes(scope: Scope) -> None:
    scope.columns(POSITION, SPEED)
    scope.feed(0, 2000, 2)
    pictures = {scope.pixels()}
    scope.page.emulate_media(color_scheme="dark")
    pictures.add(scope.pixels())
    scope.page.emulate_media(forced_colors="active")
    pictures.add(scope.pixels())
    scope.page.set_viewport_size({"width": 360, "height": 700})
    pictures.add(scope.pixels())
    assert len(pictures) == 4
    assert scope.page.evaluate("document.documentElement.scrollWidth") <= 360
