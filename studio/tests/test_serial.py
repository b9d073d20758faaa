"""A module at a real serial port, by the browser's own Web Serial: `tmcl sim --serial`."""

from __future__ import annotations

import random
from collections.abc import Iterator
from itertools import pairwise, takewhile
from pathlib import Path

import pytest
from bed import browser as browsers
from bed.browser import Browser, until
from bed.module import VirtualModule
from bed.server import Site
from playwright.sync_api import Playwright, expect
from studio import Studio


@pytest.fixture
def studio(serial_chromium: Browser, studio_site: Site) -> Studio:
    """The page, which may use all ports."""
    return Studio(serial_chromium.open(studio_site.url))


@pytest.fixture
def serial_chromium(
    playwright: Playwright, tmp_path: Path, library: Path, ports: Path, studio_site: Site
) -> Iterator[Browser]:
    """Chromium, in which the page has all serial ports."""
    with browsers.chromium(playwright, tmp_path, library, ports, origins=[studio_site.origin]) as browser:
        yield browser


def test_a_module_is_commanded_and_stopped(studio: Studio, module: VirtualModule) -> None:
    studio.connect()
    assert studio.send("ROR 0, 500") == "ROR 0, 500: 500 int, status 100 ok"
    assert studio.send("GAP 2, 0").startswith("GAP 2, 0: 500 int (target speed)")
    studio.button("STOP").click()
    module.wait_for_telegrams("to 1: ROR 0, 500", "to 1: 128", "to 1: MST 0")
    assert studio.send("GAP 2, 0").startswith("GAP 2, 0: 0 int")
    assert module.ask("state")["velocity"] == 0


def test_there_is_no_port(serial_chromium: Browser, studio_site: Site) -> None:
    studio = Studio(serial_chromium.open(studio_site.url))
    studio.button("Connect").click()
    expect(studio.link).to_contain_text("dialout")
    expect(studio.link).to_contain_text("Flatpak")
    studio.start()


def test_a_silent_module_is_told(studio: Studio, module: VirtualModule) -> None:
    module.ask("power off")
    studio.button("Connect").click()
    expect(studio.link).to_contain_text("no reply")
    module.ask("power on")
    studio.connect()


@pytest.mark.parametrize(("fault", "words"), [("reply-drop", "no reply"), ("reply-corrupt", "wrong checksum")])
def test_faulty_replies_are_told(studio: Studio, module: VirtualModule, fault: str, words: str) -> None:
    studio.connect()
    module.ask(f"fault {fault} 1000000")
    assert words in studio.send("GAP 1, 0")
    module.ask(f"fault {fault} 0")
    assert studio.send("GAP 1, 0").endswith("status 100 ok"), "the page goes on"


def test_the_canopen_firmware_is_told(serial_chromium: Browser, studio_site: Site, tmp_path: Path, ports: Path) -> None:
    with VirtualModule(ports / "ttyACM0", tmp_path, "--firmware", "canopen"):
        studio = Studio(serial_chromium.open(studio_site.url))
        studio.button("Connect").click()
        expect(studio.link).to_contain_text("it has the CANopen firmware")


def test_a_lost_link_comes_back(studio: Studio, module: VirtualModule, tmp_path: Path, ports: Path) -> None:
    studio.connect()
    module.close()
    expect(studio.link).to_contain_text("the link is lost")
    expect(studio.button("Send")).to_be_disabled()
    with VirtualModule(ports / "ttyACM0", tmp_path) as again:
        studio.is_there("1140")
        # It is identified before anything else.
        first = next(line for line in again.telegrams() if " > " in line)
        assert "136, 1" in first, first
        assert studio.send("GAP 1, 0").endswith("status 100 ok")


def test_a_port_belongs_to_one_tab(
    serial_chromium: Browser, studio: Studio, module: VirtualModule, studio_site: Site
) -> None:
    studio.connect()
    other = Studio(serial_chromium.open(studio_site.url))
    other.button("Connect").click()
    expect(other.link).to_contain_text("another tab")
    studio.button("Disconnect").click()
    expect(studio.link).to_have_text("disconnected")
    other.connect()


# Stands in for the browser's chooser, in which the user takes the port of this number.
CHOOSE = "number => navigator.serial.requestPort = async () => (await navigator.serial.getPorts())[number]"


def test_of_two_adapters_of_one_kind_either_can_be_chosen(
    serial_chromium: Browser, studio_site: Site, module: VirtualModule, ports: Path, tmp_path: Path
) -> None:
    with VirtualModule(ports / "ttyACM1", tmp_path, "--product", "6110"):
        first, second = (Studio(serial_chromium.open(studio_site.url)) for _ in range(2))
        first.button("Connect").click()
        expect(first.link).to_have_text("connected")
        known = first.module.inner_text()
        other = "6110" if "1140" in known else "1140"
        # The first port is taken by the first tab; the second port is free.
        for number, words in ((0, "another tab"), (1, "connected")):
            second.page.evaluate(CHOOSE, number)
            second.button("Choose another port").click()
            expect(second.link).to_contain_text(words)
        second.is_there(other)
        # What was chosen comes first from now on.
        second.button("Disconnect").click()
        expect(second.link).to_have_text("disconnected")
        second.connect(other)
        assert first.send("GAP 1, 0").endswith("status 100 ok")
        assert first.module.inner_text() == known


@pytest.mark.parametrize("how", ["close", "reload"])
def test_a_page_that_goes_stops_what_it_has_moved(studio: Studio, module: VirtualModule, how: str) -> None:
    studio.connect()
    studio.send("ROR 0, 500")
    if how == "close":
        studio.page.close()
    else:
        studio.page.reload()
    module.wait_for_telegrams("to 1: ROR 0, 500", "to 1: MST 0")
    module.ask("pause")
    module.ask("step 5 s")
    assert module.ask("state")["velocity"] == 0


def test_a_page_that_has_moved_nothing_stops_nothing(studio: Studio, module: VirtualModule) -> None:
    studio.connect()
    module.ask("send ROR 0, 500")
    studio.page.close()
    module.ask("state")
    assert not any("MST" in line for line in module.telegrams())


def test_jobs_wait_for_each_other_and_can_be_ended(studio: Studio, module: VirtualModule) -> None:
    studio.connect()
    studio.is_read()
    module.ask("fault reply-delay 100 ms")
    studio.button("Export").click()
    studio.button("Load program").click()
    # What is in the module is looked at before a program is loaded over it.
    first, second = studio.job("Export"), studio.job("Look at the program")
    expect(second).to_contain_text("waits until the job before it is over")
    expect(first).to_contain_text(" of ")
    second.get_by_role("button", name="End").click()
    expect(second).to_contain_text("ended")
    first.get_by_role("button", name="End").click()
    expect(first).to_contain_text("ended")
    assert not any("to 1: 132" in line for line in module.telegrams()), "the second job has not begun"
    module.ask("fault reply-delay 0 ms")
    assert studio.send("GAP 1, 0").endswith("status 100 ok")


def test_rows_are_those_of_the_log(studio: Studio, module: VirtualModule) -> None:
    """The tick timer (global parameter 132) has another value at each reading, and nobody else reads it."""
    studio.connect()
    studio.is_read()
    before = len(module.telegrams())
    curve = studio.page.get_by_role("combobox", name="Curve")
    for index in range(2):
        studio.page.locator("#curves").get_by_role("button", name="Remove").first.click()
        expect(studio.page.locator("#curves").get_by_role("listitem")).to_have_count(1 - index)
    curve.fill("GGP 132, 0")
    curve.press("Enter")
    module.wait_for_telegrams(*["to 1: GGP 132, 0"] * 50)
    with studio.page.expect_download() as got:
        studio.button("CSV of all rows").click()
    _, *rows = Path(got.value.path()).read_text().splitlines()
    shown = [int(row.split(",")[1]) for row in rows]
    logged = [
        int(reply.split("from 1: ")[1].split(" ms ")[0])
        for asked, reply in pairwise(module.telegrams()[before:])
        if "to 1: GGP 132, 0" in asked
    ]
    assert len(shown) > 20
    assert shown == logged[: len(shown)]


def test_a_slow_link_is_the_scopes_for_the_most_part(studio: Studio, module: VirtualModule) -> None:
    """What other panels read leaves it most of the time, however slow it is."""
    studio.connect()
    studio.is_read()
    curve = studio.page.get_by_role("combobox", name="Curve")
    curve.fill("GGP 132, 0")
    curve.press("Enter")
    module.wait_for_telegrams("to 1: GGP 132, 0")
    module.ask("fault reply-delay 16 ms")
    before = len(module.telegrams())
    module.wait_for_telegrams(*["to 1: GGP 132, 0"] * (module.log.read_text().count("to 1: GGP 132, 0") + 100))
    requests = [line for line in module.telegrams()[before:] if " > " in line]
    rows = sum("to 1: GGP 132, 0" in line for line in requests)
    # Position, speed and tick timer: three requests a row.
    assert 3 * rows > 0.7 * len(requests), (rows, len(requests))


# Notes, in the worker of the link, when a STOP comes to it and what is written to the port.
NOTE = """() => {
    self.noted = [];
    self.addEventListener("message", ({ data }) => {
        if (data.asked?.stop) {
            noted.push(["asked", performance.now()]);
        }
    }, { capture: true });
    const write = WritableStreamDefaultWriter.prototype.write;
    WritableStreamDefaultWriter.prototype.write = function (bytes) {
        noted.push([bytes[1], performance.now()]);
        return write.call(this, bytes);
    };
}"""
STOP_APPLICATION, MST = 128, 3


def test_a_hundred_stops(studio: Studio, module: VirtualModule) -> None:
    """With samples and a job filling the link, no STOP waits for more than the one exchange that is under way."""
    studio.connect()
    studio.is_read()
    # The workers of the tools and of the tables were there before.
    link = studio.page.workers[-1]
    link.evaluate(NOTE)
    chance = random.Random(7)
    jobs = studio.job("Export")
    for _ in range(100):
        if jobs.filter(has_text=" of ").count() == 0:
            studio.button("Export").click()
            expect(jobs.last).to_contain_text(" of ")
        studio.page.wait_for_timeout(chance.uniform(0, 30))
        studio.page.keyboard.press("Escape")
    # Until the last STOP is on the wire, whatever that takes.
    last = "noted.findLastIndex(([what]) => what === 'asked')"
    until(link, f"noted.slice({last}).some(([what]) => what === {MST})")
    noted: list[tuple[str | int, float]] = link.evaluate("noted")
    waits = []
    for index, (what, asked) in enumerate(noted):
        if what == "asked":
            # What was under way had been written before; nothing else is written until all is stopped. A STOP that
            # comes while another one is under way is the same.
            to_stop = takewhile(lambda entry: entry[0] in ("asked", STOP_APPLICATION, MST), noted[index + 1 :])
            written = [when for what, when in to_stop if what == MST]
            assert written, noted[index : index + 4]
            waits.append(written[0] - asked)
    others = sum(1 for what, _ in noted if what not in ("asked", STOP_APPLICATION, MST))
    assert len(waits) == 100
    assert others > 300
    waits.sort()
    print(f"STOP on the wire: median {waits[50]:.1f} ms, worst {waits[-1]:.1f} ms, with {others} other requests")
