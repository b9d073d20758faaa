"""What is not as it should be: browsers that cannot, and modules that are strange."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from bed import browser as browsers
from bed.browser import Browser, until
from bed.fake import Fake, reply
from bed.module import VirtualModule
from bed.server import Site
from playwright.sync_api import Playwright, expect
from studio import Studio

# Commands 136 and 1 (ROR).
VERSION, ROR = 136, 1


@pytest.fixture
def without_serial(playwright: Playwright, tmp_path: Path, library: Path, ports: Path) -> Iterator[Browser]:
    """Chromium without Web Serial."""
    arguments = ["--disable-blink-features=Serial"]
    with browsers.chromium(playwright, tmp_path, library, ports, arguments=arguments) as browser:
        yield browser


@pytest.fixture
def without_suspension(playwright: Playwright, tmp_path: Path, library: Path, ports: Path) -> Iterator[Browser]:
    """Firefox that does not suspend WebAssembly; Chromium has no such switch."""
    preferences = {"javascript.options.wasm_js_promise_integration": False}
    with browsers.firefox(playwright, tmp_path, library, ports, preferences=preferences) as browser:
        yield browser


@pytest.fixture(params=["without_serial", "without_suspension"])
def limited(request: pytest.FixtureRequest) -> Browser:
    """A browser without what real modules need."""
    browser: Browser = request.getfixturevalue(request.param)
    return browser


def test_without_it_virtual_modules_work(limited: Browser, studio_site: Site) -> None:
    studio = Studio(limited.open(studio_site.url))
    missing = studio.page.evaluate("[!('Suspending' in WebAssembly), !('serial' in navigator)]")
    assert sorted(missing) == [False, True]
    studio.button("Connect").click()
    expect(studio.link).to_contain_text("Chrome and Edge (from 137 on) and Firefox (from 153 on) do")
    studio.start("6110")
    assert studio.send("ROR 5, 500").endswith("status 100 ok")
    studio.control("pause")
    studio.control("step 1 s")
    assert studio.control("state")["axes"][5]["velocity"] == 500
    studio.button("STOP").click()
    expect(studio.danger).to_have_text("")
    studio.control("step 5 s")
    assert studio.control("state")["axes"][5]["velocity"] == 0
    studio.button("Export").click()
    expect(studio.job("Export")).to_contain_text("done")


@pytest.fixture
def studio(playwright: Playwright, tmp_path: Path, library: Path, ports: Path, studio_site: Site) -> Iterator[Studio]:
    """The page in Chromium, which has all serial ports."""
    with browsers.chromium(playwright, tmp_path, library, ports, origins=[studio_site.origin]) as browser:
        yield Studio(browser.open(studio_site.url))


def test_a_strange_module_is_commanded_all_the_same(studio: Studio, ports: Path) -> None:
    def answer(request: bytes) -> bytes:
        return reply(request, 9999 << 16 | 0x0203 if request[1] == VERSION else 7)

    with Fake(ports / "ttyACM0", answer) as fake:
        studio.button("Connect").click()
        expect(studio.module).to_have_text("TMCM-9999, firmware 2.03, which is not known here")
        assert studio.send("ROR 0, 500") == "ROR 0, 500: 7, status 100 ok"
        studio.button("STOP").click()
        # Six axes, as the largest module has that is known.
        fake.wait_for(bytes([1, 3, 0, 5]))
        assert [request[3] for request in fake.requests if request[1] == 3] == [0, 1, 2, 3, 4, 5]


def test_half_a_reply_is_told(studio: Studio, ports: Path) -> None:
    def answer(request: bytes) -> bytes:
        whole = reply(request, 1140 << 16 | 0x012A if request[1] == VERSION else 0)
        return whole[:5] if request[1] == ROR else whole

    with Fake(ports / "ttyACM0", answer):
        studio.connect()
        assert "only 5 of 9 bytes of a reply came" in studio.send("ROR 0, 500")
        assert studio.send("GAP 1, 0").endswith("status 100 ok"), "the page goes on"


# Notes, in the worker of the link, how many bytes have come, and stops its clock until `release` is called.
HOLD = """() => {
    self.came = 0;
    const { now } = performance;
    const held = now.call(performance);
    performance.now = () => held;
    self.release = () => delete performance.now;
    const read = ReadableStreamDefaultReader.prototype.read;
    ReadableStreamDefaultReader.prototype.read = async function () {
        const chunk = await read.call(this);
        came += chunk.value?.length ?? 0;
        return chunk;
    };
}"""


def test_a_late_reply_is_not_taken_for_another_ones(studio: Studio, ports: Path) -> None:
    """GAP 240 is answered when its time is over; GAP 250, of the same number, is not sent before that, but STOP is."""
    silent = b""

    def answer(request: bytes) -> bytes:
        nonlocal silent
        if request[1:3] == bytes([6, 240]):
            silent = request
            return b""
        return reply(request, 1140 << 16 | 0x012A if request[1] == VERSION else request[2])

    with Fake(ports / "ttyACM0", answer) as fake:
        studio.connect()
        link = studio.page.workers[-1]
        link.evaluate(HOLD)
        assert "no reply; check power, wiring, address" in studio.send("GAP 240, 0")
        studio.line.fill("GAP 250, 0")
        studio.line.press("Enter")
        studio.page.keyboard.press("Escape")
        fake.wait_for(bytes([1, 3]))
        # What waited was dropped by STOP; this one waits now.
        studio.line.fill("GAP 250, 0")
        studio.line.press("Enter")
        came = link.evaluate("came")
        fake.say(reply(silent, 4444))
        until(link, f"came >= {came} + 9")
        assert not any(request[1:3] == bytes([6, 250]) for request in fake.requests)
        link.evaluate("release()")
        expect(studio.replies.last).to_contain_text("GAP 250, 0: 250 ")


def begin(studio: Studio, module: VirtualModule, job: str) -> None:
    """Begins a job, which takes a while."""
    studio.is_read()
    module.ask("fault reply-delay 20 ms")
    studio.button(job).click()
    expect(studio.job(job)).to_contain_text(" of ")


def begin_download(studio: Studio, module: VirtualModule) -> None:
    """Begins to load a program."""
    studio.page.get_by_role("textbox", name="Program").fill("ROL 0, 700\n" * 200)
    begin(studio, module, "Load program")


def test_a_port_that_goes_during_a_job(studio: Studio, ports: Path, tmp_path: Path) -> None:
    with VirtualModule(ports / "ttyACM0", tmp_path) as module:
        studio.connect()
        begin(studio, module, "Export")
    expect(studio.link).to_contain_text("the link is lost")
    expect(studio.job("Export")).to_contain_text("link")
    with VirtualModule(ports / "ttyACM0", tmp_path):
        studio.is_there("1140")
        studio.button("Export").click()
        expect(studio.job("Export").last).to_contain_text("done")


def test_a_stop_that_finds_the_link_lost_is_sent_when_it_is_back(studio: Studio, ports: Path, tmp_path: Path) -> None:
    with VirtualModule(ports / "ttyACM0", tmp_path):
        studio.connect()
    expect(studio.link).to_contain_text("the link is lost")
    studio.button("STOP").click()
    expect(studio.danger).to_contain_text("the motor may turn")
    with VirtualModule(ports / "ttyACM0", tmp_path) as module:
        module.wait_for_telegrams("136, 1", "to 1: 128", "to 1: MST 0")
        expect(studio.danger).to_have_text("")


def test_another_module_takes_the_place_of_one_under_way(studio: Studio, ports: Path, tmp_path: Path) -> None:
    """While it is debugged, watched and read: what belonged to it is gone, and the page goes on with the other one."""
    with VirtualModule(ports / "ttyACM0", tmp_path) as module:
        studio.connect()
        studio.load("Loop: CALC ADD, 5\nJA Loop\n")
        begin(studio, module, "Export")
    expect(studio.link).to_contain_text("the link is lost")
    expect(studio.job("Export")).to_contain_text("link")
    with VirtualModule(ports / "ttyACM0", tmp_path, "--product", "6110"):
        studio.is_there("6110")
        studio.is_read()
        axes = studio.page.get_by_role("combobox", name="Axis", exact=True).get_by_role("option")
        expect(axes).to_have_count(6)
        expect(studio.page.get_by_role("table", name="Axes").get_by_role("row")).to_have_count(12)
        expect(studio.page.get_by_role("status", name="Debugger")).not_to_contain_text("halted")
        expect(studio.button("Step")).to_be_disabled()
        expect(studio.page.get_by_role("textbox", name="Program")).to_have_value("Loop: CALC ADD, 5\nJA Loop\n")
        assert studio.send("GAP 1, 5").endswith("status 100 ok")


def test_only_the_last_of_several_attempts_counts(studio: Studio, ports: Path, tmp_path: Path) -> None:
    with VirtualModule(ports / "ttyACM0", tmp_path) as module:
        for _ in range(3):
            studio.button("Connect").click(no_wait_after=True)
            studio.button("Start").click(no_wait_after=True)
        studio.page.get_by_label("Virtual module", exact=True).select_option("6110")
        studio.button("Start").click()
        studio.is_there("6110")
        assert studio.send("GAP 1, 5").endswith("status 100 ok")
        before = len(module.telegrams())
        studio.page.wait_for_timeout(500)
        assert len(module.telegrams()) == before, "nobody asks the module at the port any more"


def test_a_job_that_waits_is_not_done_at_another_module(studio: Studio, ports: Path, tmp_path: Path) -> None:
    with VirtualModule(ports / "ttyACM0", tmp_path) as module:
        studio.connect()
        studio.is_read()
        module.ask("fault reply-delay 50 ms")
        studio.button("Export").click()
        studio.button("Load program").click()
        expect(studio.job("Look at the program")).to_contain_text("waits until")
        studio.start("3110")
        expect(studio.job("Look at the program")).to_contain_text("ended")
        assert studio.send("134, 0, 0, 0").startswith("134, 0, 0, 0: 0, 0, 0, 0")


@pytest.mark.parametrize(
    ("field", "value"), [("Address", "300"), ("Address", ""), ("Bit rate", "2.5"), ("Bit rate", "0")]
)
def test_what_is_no_number_of_a_link_is_told(studio: Studio, field: str, value: str) -> None:
    studio.page.get_by_label(field, exact=True).fill(value)
    studio.button("Connect").click()
    expect(studio.link).to_contain_text(f"{field}: ")
    expect(studio.page.get_by_label(field, exact=True)).to_be_focused()


def test_stop_ends_a_download_and_the_motor(studio: Studio, ports: Path, tmp_path: Path) -> None:
    """In download mode a module stores commands, also those that should stop it."""
    with VirtualModule(ports / "ttyACM0", tmp_path) as module:
        studio.connect()
        studio.send("ROR 0, 500")
        begin_download(studio, module)
        studio.button("STOP").click()
        expect(studio.job("Load program")).to_contain_text("interrupted")
        stopped = ("to 1: 133", "to 1: 128", "to 1: MST 0", "status 100")
        module.wait_for_telegrams("to 1: 132", *stopped, "to 1: 132", "to 1: STOP", "to 1: 133", "status 100")
        module.ask("fault reply-delay 0 ms")
        module.ask("pause")
        module.ask("step 3 s")
        assert module.ask("state")["velocity"] == 0
        module.ask("resume")
        assert studio.send("GAP 2, 0").endswith("status 100 ok"), "it carries commands out again"
        commands = [line for line in module.telegrams() if " > " in line and "to 1: GAP" in line]
        during = module.telegrams()[module.first("to 1: 132") : module.first("to 1: 133")]
        assert studio.send("134, 0, 0, 0").startswith("134, 0, 0, 0: STOP"), "nothing is left of the program"
        assert commands
        assert not any("to 1: GAP" in line for line in during), "no samples in between the program"


def test_a_page_that_goes_during_a_download_stops_the_motor(studio: Studio, ports: Path, tmp_path: Path) -> None:
    with VirtualModule(ports / "ttyACM0", tmp_path) as module:
        studio.connect()
        studio.send("ROR 0, 500")
        begin_download(studio, module)
        studio.page.close()
        module.wait_for_telegrams("to 1: 132", "to 1: 133", "to 1: MST 0", "status 100")
        module.ask("pause")
        module.ask("step 3 s")
        assert module.ask("state")["velocity"] == 0


def test_the_end_of_a_download_leaves_the_module_as_it_should_be(studio: Studio, ports: Path, tmp_path: Path) -> None:
    with VirtualModule(ports / "ttyACM0", tmp_path) as module:
        studio.connect()
        begin_download(studio, module)
        job = studio.job("Load program")
        job.get_by_role("button", name="End").click()
        expect(job).to_contain_text("interrupted")
        module.ask("fault reply-delay 0 ms")
        assert studio.send("ROR 0, 500").endswith("status 100 ok")
        assert studio.send("134, 0, 0, 0").startswith("134, 0, 0, 0: STOP"), "what is there does not run"


def test_nothing_that_was_asked_before_is_done_after_stop(studio: Studio, ports: Path, tmp_path: Path) -> None:
    with VirtualModule(ports / "ttyACM0", tmp_path) as module:
        studio.connect()
        begin(studio, module, "Export")
        studio.line.fill("ROR 0, 500")
        studio.line.press("Enter")
        studio.button("STOP").click()
        expect(studio.replies).to_have_text("ROR 0, 500: ended")
        expect(studio.job("Export")).to_contain_text("ended")
        assert studio.send("GAP 2, 0").startswith("GAP 2, 0: 0 int")
        assert not any("to 1: ROR" in line for line in module.telegrams())


def test_a_link_that_came_back_is_left_as_the_first_one(studio: Studio, ports: Path, tmp_path: Path) -> None:
    with VirtualModule(ports / "ttyACM0", tmp_path) as module:
        studio.connect()
        studio.send("ROR 0, 500")
        module.ask("usb off --hangup")
        expect(studio.link).to_contain_text("the link is lost")
        module.ask("usb on")
        studio.is_there("1140")
        studio.page.close()
        module.wait_for_telegrams("to 1: ROR 0, 500", "136, 1", "to 1: MST 0")
