"""Inputs, outputs and axes in words: the panels alone, with a module that the test plays."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from typing import Any

import pytest
from bed.browser import Browser
from bed.module import ROOT
from bed.server import Site
from playwright.sync_api import Locator, Page, expect

PAGE = ROOT / "studio" / "page"
HTML = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Status</title>
<link rel="icon" href="data:,">
<meta http-equiv="Content-Security-Policy"
content="default-src 'none'; script-src 'self'; style-src 'self'; img-src data:">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="stylesheet" href="style.css"><link rel="stylesheet" href="panels/panels.css"></head>
<body><main><h1>Status</h1><section aria-labelledby="inputs-title"><h2 id="inputs-title">Inputs and outputs</h2>
<div id="inputs"></div></section><section aria-labelledby="axes-title">
<h2 id="axes-title">Axes</h2><div id="axes"></div>
</section></main><script type="module" src="test.js"></script></body></html>"""
# A module whose values and words the test sets. What it is asked and sent is noted.
SCRIPT = """import { InputsPanel } from './panels/inputs.js';
import { AxesPanel } from './panels/axes.js';
const play = globalThis.play = { told: {}, readings: {}, lines: {}, errors: [], sent: [], jobs: [], announced: [],
    asked: [], sampled: new Map(), refuses: false, held: [] };
const services = {
    ask: async (door, asked) => {
        play.asked.push({ door, asked });
        if (play.holds) { await new Promise((go) => play.held.push(go)); }
        switch (door) {
            case 'status_requests': return play.told[asked.product] ?? play.told.unknown;
            case 'status_readings': return { readings: asked.values.map((value, at) => value === null
                ? { text: '', on: null } : play.readings[asked.requests[at].kind](value)) };
            default: return { lines: play.lines[asked.axis](asked.values) };
        }
    },
    sample: (requests, hear) => {
        const key = {};
        play.sampled.set(key, { requests, hear });
        return () => play.sampled.delete(key);
    },
    send: async (request) => {
        play.sent.push(request);
        if (play.holds) { await new Promise((go) => play.held.push(go)); }
        if (play.refuses instanceof Error) { throw play.refuses; }
        return play.refuses ? null : request.value;
    },
    job: async (name, door, asked) => {
        play.jobs.push({ name, door, asked });
        return { lines: play.errors.shift() ?? [{ severity: 'fine', words: 'nothing has stopped the motor' }] };
    },
    announce: (text) => play.announced.push(text),
};
const gio = (kind) => ({ address: 1, opcode: 15, kind, motor: 0, value: 0 });
const sio = (kind, value) => ({ address: 1, opcode: 14, kind, motor: 2, value });
const port = (name, kind, request, set = null) => ({ name, kind, unit: '', switchable: set !== null, request, set });
play.told['3110'] = { note: null, inputs: [
    port('IN0', 'digital', gio(0)),
    port('IN0', 'analog', gio(1)),
    port('supply voltage', 'measured', gio(2)),
    port('left limit switch of axis 0', 'switch', gio(3)),
    port('OUT0', 'output', gio(4), { on: sio(4, 1), off: sio(4, 0) }),
    port('pull-up resistors of the switches', 'pull_ups', null, { on: sio(0, 1), off: sio(0, 0) }),
], axes: [0, 1, 2].map((axis) => ({ axis, latches: axis > 0, requests: [gio(10 + axis), gio(20 + axis)] })) };
play.told.unknown = { note: 'what it has is not known', inputs: [],
    axes: [{ axis: 0, latches: true, requests: [gio(10)] }] };
const either = (yes, no) => (value) => ({ text: value ? yes : no, on: value !== 0 });
play.readings = { 0: either('high', 'low'), 1: (value) => ({ text: `${value} of 4095`, on: null }),
    2: (value) => ({ text: `${value / 10} V`, on: null }), 3: either('closed', 'open'), 4: either('on', 'off') };
const fault = ([at, kind]) =>
    ({ severity: kind > 1 ? 'error' : 'warning', words: `fault ${'AB'[kind % 2]} at ${at}` });
const lines = (values) => [
    { severity: 'fine', words: `stands at ${values[0]} microsteps` },
    ...(values[1] ? [fault(values)] : []),
];
play.lines = { 0: lines, 1: lines, 2: lines };
play.feed = (inputs, axes) => [...play.sampled.values()].forEach(({ requests, hear }) =>
    hear(requests[0].kind < 10 ? inputs : axes));
play.inputs = new InputsPanel(document.querySelector('#inputs'), services);
play.axes = new AxesPanel(document.querySelector('#axes'), services);"""
INPUTS = [1, 302, 241, 0, 0]
AXES = [7, 0, 8, 0, 9, 0]


class Status:
    """A page with nothing but the two panels."""

    def __init__(self, page: Page):
        self.page = page
        self.output = page.get_by_role("switch", name="OUT0")
        expect(page.get_by_text("no module")).to_have_count(2)

    def module(self, product: str | None = "3110") -> None:
        """A module is there."""
        self.page.evaluate(
            """async (product) => {
            await play.inputs.module({ product, address: 1 });
            await play.axes.module({ product, address: 1 });
        }""",
            product,
        )

    def feed(self, inputs: Sequence[int | None] = INPUTS, axes: Sequence[int | None] = AXES) -> None:
        """The module has been read."""
        self.page.evaluate("([inputs, axes]) => play.feed(inputs, axes)", [list(inputs), list(axes)])

    def value(self, name: str, table: str) -> Locator:
        """The value in a row of a table."""
        rows = self.page.get_by_role("table", name=table).get_by_role("row")
        return rows.filter(has=self.page.get_by_role("rowheader", name=name, exact=True)).get_by_role("cell")

    def lines(self, axis: int) -> Locator:
        """What there is to say of an axis."""
        return self.page.get_by_role("list", name=f"Axis {axis} in words").get_by_role("listitem")

    def noted(self, what: str) -> Any:
        """What the module has noted."""
        return self.page.evaluate(f"play.{what}")


@pytest.fixture
def status(plain_chromium: Browser, site: Site) -> Status:
    """The panels, with the page's own style."""
    shutil.copytree(PAGE / "panels", site.folder / "panels")
    shutil.copy(PAGE / "dom.js", site.folder)
    shutil.copy(PAGE / "style.css", site.folder)
    site.write(index__html=HTML, test__js=SCRIPT)
    return Status(plain_chromium.open(site.url))


def test_values_are_shown_in_words_with_a_mark(status: Status) -> None:
    status.module()
    expect(status.value("IN0", "Digital inputs")).to_have_text("-")
    status.feed()
    expect(status.value("IN0", "Digital inputs")).to_have_text("\u25cfhigh")
    expect(status.value("IN0", "Analog inputs")).to_have_text("302 of 4095")
    expect(status.value("supply voltage", "Module")).to_have_text("24.1 V")
    expect(status.value("left limit switch of axis 0", "Limit and home switches")).to_have_text("\u25cbopen")
    status.feed([0, None, 74, 1, 1])
    expect(status.value("IN0", "Digital inputs")).to_have_text("\u25cblow")
    expect(status.value("IN0", "Analog inputs")).to_have_text("-")
    expect(status.value("left limit switch of axis 0", "Limit and home switches")).to_have_text("\u25cfclosed")
    # Nothing that changes all the time is read out.
    assert status.page.locator("[aria-live], [role=status], [role=alert], [role=log]").count() == 0


def test_an_output_is_switched_and_shows_what_is_read_back(status: Status) -> None:
    status.module()
    status.output.press("Enter")
    assert status.noted("sent") == [], "what has not been read is not switched"
    status.feed()
    expect(status.output).not_to_be_checked()
    status.output.press("Space")
    assert [request["value"] for request in status.noted("sent")] == [1]
    expect(status.output).not_to_be_checked()
    status.feed([1, 302, 241, 0, 1])
    expect(status.output).to_be_checked()
    expect(status.output).to_have_text("\u25cfon")
    expect(status.output).to_be_focused()
    status.output.click()
    assert [request["value"] for request in status.noted("sent")] == [1, 0]
    assert {(request["opcode"], request["kind"], request["motor"]) for request in status.noted("sent")} == {(14, 4, 2)}


def test_a_second_press_before_the_reply_sends_nothing(status: Status) -> None:
    status.module()
    status.feed()
    expect(status.output).to_have_attribute("aria-disabled", "false")
    status.page.evaluate("play.holds = true")
    status.output.press("Enter")
    status.output.press("Enter")
    assert len(status.noted("sent")) == 1
    status.page.evaluate("play.holds = false; play.held.forEach((go) => go())")
    expect(status.output).not_to_have_attribute("aria-busy", "true")
    status.output.press("Enter")
    assert len(status.noted("sent")) == 2


def test_an_output_that_is_refused_is_told(status: Status) -> None:
    status.module()
    status.feed()
    expect(status.output).to_have_attribute("aria-disabled", "false")
    status.page.evaluate("play.refuses = true")
    status.output.click()
    told = "OUT0: the module has not carried it out"
    expect(status.page.get_by_text(told)).to_be_visible()
    assert status.noted("announced") == [told]
    expect(status.output).not_to_be_checked()
    status.page.evaluate("play.refuses = new Error('the link is <b>lost</b>')")
    status.output.click()
    expect(status.page.get_by_text("OUT0: the link is <b>lost</b>")).to_be_visible()
    assert status.page.locator("b").count() == 0


def test_pull_ups_are_switched_and_not_read(status: Status) -> None:
    status.module()
    name = "pull-up resistors of the switches"
    expect(status.value(name, "Pull-up resistors")).to_contain_text("cannot be read back")
    status.page.get_by_role("button", name=f"{name}: off").click()
    status.page.get_by_role("button", name=f"{name}: on").click()
    assert [(request["kind"], request["value"]) for request in status.noted("sent")] == [(0, 0), (0, 1)]
    sampled = status.page.evaluate("[...play.sampled.values()].map(({ requests }) => requests.length)")
    assert sampled == [5, 6]


def test_axes_are_told_in_words(status: Status) -> None:
    status.module()
    status.feed(axes=[7, 0, 8, 1, -9, 2])
    expect(status.lines(0)).to_have_text(["\u2713stands at 7 microsteps"])
    expect(status.lines(1)).to_have_text(["\u2713stands at 8 microsteps", "\u25b3Warning: fault B at 8"])
    expect(status.lines(2)).to_have_text(["\u2713stands at -9 microsteps", "\u2715Error: fault A at -9"])


def test_a_new_error_is_announced_once(status: Status) -> None:
    status.module()
    status.feed(axes=[7, 2, 8, 0, 9, 0])
    expect(status.lines(0)).to_have_count(2)
    # Its numbers change, and it is the same one.
    status.feed(axes=[8, 2, 8, 0, 9, 0])
    expect(status.lines(0).first).to_contain_text("stands at 8")
    assert status.noted("announced") == ["Axis 0: fault A at 7"]
    status.feed(axes=[8, 3, 8, 0, 9, 0])
    expect(status.lines(0).last).to_contain_text("fault B")
    assert status.noted("announced")[1:] == ["Axis 0: fault B at 8"]
    status.feed(axes=[8, 0, 8, 0, 9, 0])
    expect(status.lines(0)).to_have_count(1)
    status.feed(axes=[8, 3, 8, 3, 9, 1])
    expect(status.lines(1)).to_have_count(2)
    assert status.noted("announced")[2:] == ["Axis 0, 1: fault B at 8"], "once for both, and a warning is not announced"


def test_what_has_stopped_a_motor_is_read_on_demand_only(status: Status) -> None:
    status.module()
    status.feed()
    ask = status.page.get_by_role("button", name=re.compile("What has stopped axis"))
    expect(ask).to_have_text(["What has stopped axis 1?", "What has stopped axis 2?"])
    assert status.noted("jobs") == []
    status.page.evaluate("play.errors.push([{ severity: 'error', words: 'a stall; this reading has cleared it' }])")
    ask.last.press("Enter")
    found = status.page.get_by_role("list", name="What has stopped axis 2").get_by_role("listitem")
    expect(found).to_have_text(["\u2715Error: a stall; this reading has cleared it"])
    assert status.noted("jobs") == [{"name": "What has stopped axis 2", "door": "status_errors", "asked": {"axis": 2}}]
    assert status.noted("announced") == ["Axis 2: a stall; this reading has cleared it"]
    ask.last.press("Enter")
    expect(found).to_have_text(["\u2713nothing has stopped the motor"])


def test_an_unknown_module_is_told(status: Status) -> None:
    status.module(None)
    expect(status.page.get_by_text("what it has is not known")).to_be_visible()
    status.feed(axes=[5])
    expect(status.lines(0)).to_contain_text(["stands at 5"])
    assert status.page.get_by_role("table").count() == 0


def test_nothing_of_a_module_stays_when_it_is_gone(status: Status) -> None:
    status.module()
    status.feed()
    # Its last values are on their way when it goes, and so is what the next module has.
    status.page.evaluate("play.holds = true")
    status.feed([0, 1, 2, 1, 1])
    status.page.evaluate("play.inputs.gone(); play.axes.gone()")
    expect(status.page.get_by_text("no module")).to_have_count(2)
    assert status.page.evaluate("play.sampled.size") == 0
    status.page.evaluate("void play.inputs.module({ product: '3110', address: 1 }); play.inputs.gone()")
    status.page.evaluate("play.holds = false; play.held.forEach((go) => go())")
    expect(status.page.get_by_text("no module")).to_have_count(2)
    assert status.page.evaluate("play.sampled.size") == 0
    status.module()
    status.feed()
    expect(status.value("IN0", "Digital inputs")).to_have_text("\u25cfhigh")


def test_only_the_latest_values_wait(status: Status) -> None:
    status.module()
    before = len(status.noted("asked"))
    status.page.evaluate("play.holds = true")
    for reading in range(20):
        status.feed([1, reading, 241, 0, 0], [])
    status.page.evaluate("play.holds = false; play.held.forEach((go) => go())")
    expect(status.value("IN0", "Analog inputs")).to_have_text("19 of 4095")
    assert len(status.noted("asked")) == before + 2


@pytest.mark.parametrize("width", [360, 1400])
def test_it_fits_the_screen(status: Status, width: int) -> None:
    status.page.set_viewport_size({"width": width, "height": 800})
    status.module()
    status.feed(axes=[7, 2, 8, 1, 9, 0])
    expect(status.lines(0)).to_have_count(2)
    wide = status.page.evaluate("document.documentElement.scrollWidth")
    assert wide <= width
    for button in [*status.page.get_by_role("button").all(), status.output]:
        box = button.bounding_box()
        assert box is not None
        assert box["height"] >= (44 if width < 1100 else 24), "large enough for a finger, or a mouse"


def test_what_is_not_shown_is_not_read(status: Status) -> None:
    status.module()
    assert status.page.evaluate("play.sampled.size") == 2
    for shown, count in ((False, 1), (True, 2)):
        status.page.evaluate("shown => document.querySelector('#axes').hidden = !shown", shown)
        status.page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        assert status.page.evaluate("play.sampled.size") == count
    status.feed()
    expect(status.lines(0).first).to_contain_text("stands at 7 microsteps")
