"""The world of a virtual module: touched, drawn, and held in time."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from bed import browser as browsers
from bed.browser import Browser, until
from bed.module import PROGRAM, ROOT, VirtualModule
from bed.server import Site
from playwright.sync_api import Locator, Playwright, expect
from studio import Studio, tmcl


def world(studio: Studio) -> Locator:
    """The part of the page with the world."""
    return studio.page.get_by_role("region", name="World of the virtual module")


def last_line(studio: Studio) -> str:
    """The line of the control port that was carried out last."""
    return studio.answers.last.inner_text().splitlines()[0]


def open_axis(studio: Studio, axis: int) -> None:
    """Opens what can be touched of an axis."""
    world(studio).locator("summary").filter(has_text=f"Axis {axis}").click()


def test_what_is_touched_is_a_line_and_is_seen(studio: Studio) -> None:
    studio.start("6110")
    open_axis(studio, 5)
    page = studio.page
    left = page.get_by_role("switch", name="left switch, axis 5")
    left.click()
    expect(left).to_have_attribute("aria-checked", "true")
    assert last_line(studio) == "press left 5"
    assert studio.send("GAP 11, 5").startswith("GAP 11, 5: 1 ")
    left.click()
    expect(left).to_have_attribute("aria-checked", "false")
    load = page.get_by_role("textbox", name="load, axis 5")
    load.fill("0.5")
    load.press("Enter")
    expect(studio.row("Axis 5", "load")).to_have_text("0.5")
    assert last_line(studio) == "load 0.5 5"
    # Nothing tells whether a fault is there, so there is a button for each.
    page.get_by_role("button", name="fault short-a, axis 5: on").click()
    expect(page.get_by_role("list", name="Axis 5 in words")).to_contain_text("short")
    assert last_line(studio) == "fault short-a on 5"
    page.get_by_role("button", name="fault short-a, axis 5: off").click()
    expect(studio.answers.last).to_contain_text("fault short-a off 5")
    # A number that is missing, or two of them, would be something else for another axis.
    count = studio.answers.count()
    for typed in ("", "0.5 1"):
        load.fill(typed)
        page.get_by_role("button", name="Set: load, axis 5").click()
        assert load.evaluate("input => input.validationMessage").startswith("one number, 0 to 1")
    assert studio.answers.count() == count
    supply = page.get_by_role("textbox", name="supply", exact=True)
    supply.fill("70")
    page.get_by_role("button", name="Set: supply").click()
    expect(studio.answers.filter(has_text="supply 70")).to_contain_text("is not a number within 0 to 60")
    supply.fill("12.5")
    supply.press("Enter")
    expect(studio.answers.filter(has_text="supply 12.5")).to_have_count(1)
    assert studio.control("state")["supply"] == 12.5
    page.get_by_role("combobox", name="CAN controller").select_option("off")
    expect(studio.answers.filter(has_text="can off")).to_have_count(1)
    assert studio.control("state")["can"] == "off"
    expect(page.get_by_role("switch", name="power")).to_have_attribute("aria-checked", "true")


def test_the_lines_can_be_had_as_a_file(in_chromium: Studio, tmp_path: Path) -> None:
    studio = in_chromium
    studio.start()
    studio.page.get_by_role("switch", name="left switch").click()
    expect(studio.answers).to_have_count(1)
    studio.control("load 0.5")
    assert studio.control("load 5")["ok"] is False, "what was refused is no line of a test"
    with studio.page.expect_download() as got:
        studio.button("Save lines").click()
    assert Path(got.value.path()).read_text() == "press left 0\nload 0.5\n"


def test_the_lines_can_be_copied(plain_chromium: Browser, studio_site: Site) -> None:
    page = plain_chromium.new_context(permissions=["clipboard-read", "clipboard-write"]).new_page()
    page.goto(studio_site.url)
    studio = Studio(page)
    studio.start()
    studio.control("press left")
    studio.control("supply 20")
    studio.button("Copy lines").click()
    expect(page.get_by_role("status", name="Announced")).to_have_text("copied")
    assert page.evaluate("navigator.clipboard.readText()") == "press left\nsupply 20"
    # The lines of another module are not among them.
    studio.start("3110")
    studio.control("press left 2")
    studio.button("Copy lines").click()
    until(page, "navigator.clipboard.readText().then(text => text === 'press left 2')")


def test_time_is_hurried_and_begun_anew(studio: Studio) -> None:
    studio.start()
    page = studio.page
    speed = page.get_by_role("textbox", name="Speed of time")
    speed.fill("50")
    studio.button("Set speed").click()
    expect(studio.answers.last).to_contain_text('speed 50\n{"ok":true')
    assert studio.control("state")["speed_wanted"] == 50
    speed.fill("fast")
    studio.button("Set speed").click()
    expect(studio.answers.last).to_contain_text('"ok":false')
    studio.send("ROR 0, 300")
    studio.button("Restart").click()
    expect(studio.answers.filter(has_text="restart")).to_contain_text('"ok":true')
    studio.is_there("1140")
    studio.control("pause")
    state = studio.control("state")
    assert (state["velocity"], state["position"]) == (0, 0)
    assert studio.control("resume")["ok"]


def test_time_is_held_and_stepped(studio: Studio) -> None:
    studio.start()
    # Who reads meanwhile lets time pass.
    studio.is_read()
    page = studio.page
    page.get_by_role("button", name="Pause time", exact=True).click()
    now = page.get_by_role("status", name="Virtual time")
    expect(now).to_contain_text("paused")
    before = studio.control("state")["time_us"]
    page.get_by_role("textbox", name="Length of a step").fill("1500 ms")
    studio.button("Step time").click()
    expect(studio.answers.last).to_contain_text("step 1500 ms")
    assert studio.control("state")["time_us"] == before + 1_500_000
    expect(now).to_contain_text(f"{(before + 1_500_000) / 1e6:.3f} s, paused")
    # A request lets pass what it needs, and no more.
    studio.send("MVP ABS, 0, 51200")
    asked = studio.control("state")["time_us"] - before - 1_500_000
    assert 0 < asked <= 10_000
    page.get_by_role("textbox", name="Condition").fill("position = 51200")
    studio.button("Run until").click()
    expect(studio.answers.last).to_contain_text('"met":true')
    expect(studio.row("Axes", "actual position (microsteps)")).to_have_text("51200")
    page.get_by_role("textbox", name="Condition").fill("velocity > 0")
    page.get_by_role("textbox", name="Longest time").fill("50 ms")
    studio.button("Run until").click()
    expect(studio.answers.last).to_contain_text('"met":false')
    page.get_by_role("textbox", name="Condition").fill("no such thing")
    studio.button("Run until").click()
    expect(studio.answers.last).to_contain_text('"ok":false')
    page.get_by_role("button", name="Pause time", exact=True).click()
    expect(now).to_contain_text("goes")


def test_a_condition_that_never_comes_is_interrupted(studio: Studio) -> None:
    """What is asked meanwhile is answered, whatever comes first."""
    studio.start()
    page = studio.page
    page.get_by_role("button", name="Pause time", exact=True).click()
    page.get_by_role("textbox", name="Condition").fill("position = 7")
    page.get_by_role("textbox", name="Longest time").fill("1 h")
    studio.button("Run until").click()
    expect(page.get_by_role("status", name="Virtual time")).to_contain_text("goes as fast as it can")
    # Its own answer comes before that of the line before.
    studio.page.get_by_role("switch", name="left switch").click()
    expect(studio.answers.last).to_contain_text("press left 0")
    studio.button("Interrupt").click()
    expect(studio.answers.filter(has_text="run-until position = 7 max 1 h")).to_contain_text('"met":false')
    expect(studio.answers.filter(has_text="interrupt")).to_contain_text('"ok":true')


def test_equal_sessions_give_equal_numbers(in_chromium: Studio) -> None:
    """Paused, the computer's speed makes no difference."""
    studio = in_chromium
    numbers = []
    for _ in range(2):
        studio.start("3110")
        studio.is_read()
        studio.control("pause")
        # A module that begins anew is read anew.
        readings = studio.job("Read all")
        count = readings.count()
        studio.control("restart")
        expect(readings).to_have_count(count + 1)
        expect(readings.last).to_contain_text("done")
        studio.control("step 100 ms")
        studio.send("ROR 2, 400")
        studio.control("step 700 ms")
        studio.control("load 0.4 2")
        studio.control("step 900 ms")
        axes = studio.control("state")["axes"]
        numbers.append([axes[2][name] for name in ("position", "velocity", "rotor", "lost_steps")])
        assert axes[2]["velocity"] > 0
    assert numbers[0] == numbers[1]


def name_text(studio: Studio, name: str, text: str) -> None:
    """Makes a text of this name."""
    studio.button("New").click()
    studio.program(text)
    studio.button("Rename").click()
    field = studio.page.get_by_role("textbox", name="New name")
    field.fill(name)
    field.press("Enter")


def test_rotor_and_stage_are_drawn_to_scale(in_chromium: Studio) -> None:
    studio = in_chromium
    name_text(
        studio, "stage.toml", "[stage]\nleft = -51200\nright = 102400\nhard_left = -102400\nhard_right = 153600\n"
    )
    studio.page.get_by_role("combobox", name="World").select_option("stage.toml")
    studio.start()
    studio.control("pause")
    studio.send("MVP ABS, 0, 12800")
    studio.control("run-until position = 12800 max 10 s")
    expect(studio.row("Axis 0", "rotor (1/256 full steps)")).to_have_text(re.compile("^1[0-9]{4}$"))
    drawn = studio.page.get_by_role("img", name="Rotor and stage of axis 0")
    rotor = int(studio.row("Axis 0", "rotor (1/256 full steps)").inner_text())
    # The way of 256 000 units is 296 long and begins at 96; a quarter of a turn is 12 800 units.
    carriage = drawn.locator(".world-carriage")
    expected = 96 + 296 * (rotor + 102_400) / 256_000
    expect(carriage).to_have_attribute("transform", f"translate({expected:.1f} 0)")
    hand = drawn.locator(".world-hand")
    expect(hand).to_have_attribute("transform", f"rotate({rotor / 51_200 * 360:.1f} 40 40)")
    zones = drawn.locator(".world-zone")
    expect(zones).to_have_count(2)
    left, right = zones.nth(0), zones.nth(1)
    assert float(left.get_attribute("x") or "") == 96
    assert float(left.get_attribute("width") or "") == pytest.approx(296 * 51_200 / 256_000)
    assert float(right.get_attribute("x") or "") == pytest.approx(96 + 296 * 204_800 / 256_000)
    studio.control("press left")
    expect(left).to_have_class(re.compile("world-closed"))


def test_where_nothing_is_to_move_the_drawing_goes_on_in_steps(plain_chromium: Browser, studio_site: Site) -> None:
    page = plain_chromium.new_context(reduced_motion="reduce").new_page()
    page.goto(studio_site.url)
    studio = Studio(page)
    studio.start()
    studio.send("ROR 0, 500")
    hand = page.get_by_role("img", name="Rotor and stage of axis 0").locator(".world-hand")
    changes = hand.evaluate(
        """hand => new Promise(done => {
            let count = 0;
            new MutationObserver(() => { count += 1; }).observe(hand, { attributes: true });
            setTimeout(() => done(count), 2500);
        })"""
    )
    # Each look draws once for the rotor and once for each switch.
    assert changes <= 3 * 4


def test_the_same_module_in_tmcl(in_chromium: Studio) -> None:
    """What is offered are lines that `tmcl sim` takes as well."""
    assert PROGRAM.exists()
    assert (ROOT / "docs" / "control.md").exists()
    studio = in_chromium
    studio.start("3212")
    open_axis(studio, 2)
    for switch in world(studio).get_by_role("switch").all():
        if switch.is_visible() and "power" not in switch.inner_text() and "USB" not in switch.inner_text():
            switch.click()
    expect(studio.answers.first).to_be_visible()
    for answer in studio.answers.all_inner_texts():
        assert json.loads(answer.splitlines()[-1])["ok"] is True, answer


def test_time_that_falls_behind_says_so_and_loses_nothing(in_chromium: Studio) -> None:
    """As in a hidden page, or where the computer has slept: the thread of the link has no time."""
    studio = in_chromium
    studio.start()
    studio.is_read()
    now = studio.page.get_by_role("status", name="Virtual time")
    link = studio.page.workers[-1]
    link.evaluate("() => { const until = performance.now() + 900; while (performance.now() < until); }")
    expect(now).to_have_text(re.compile(r"(0\.[89]|[1-9]\d*\.\d) s behind the clock$"))
    with studio.page.expect_download() as got:
        studio.button("CSV of all rows").click()
    lines = Path(got.value.path()).read_text().splitlines()[1:]
    times = [float(line.split(",")[0]) for line in lines]
    assert times == [times[0] + index for index in range(len(times))], "each millisecond once"
    # While it is paused nothing is late.
    studio.control("pause")
    expect(now).to_have_text(re.compile(" s, paused$"))


def test_a_hidden_page_loses_nothing(
    playwright: Playwright, library: Path, ports: Path, studio_site: Site, tmp_path: Path
) -> None:
    """In a browser that lets hidden pages go as slowly as those of users do."""
    with browsers.running_chromium(playwright, tmp_path, library, ports, throttled=True) as driven:
        page = driven.new_context().new_page()
        page.goto(studio_site.url)
        studio = Studio(page)
        studio.start()
        before = studio.control("state")["time_us"]
        other = page.context.new_page()
        other.bring_to_front()
        other.wait_for_timeout(3000)
        page.bring_to_front()
        after = studio.control("state")["time_us"]
        assert after > before
        told = page.get_by_role("status", name="Virtual time")
        expect(told).to_have_text(re.compile(r"^\d+\.\d{3} s, "))
        with page.expect_download() as got:
            studio.button("CSV of all rows").click()
        lines = Path(got.value.path()).read_text().splitlines()[1:]
        times = [float(line.split(",")[0]) for line in lines]
        assert times == [times[0] + index for index in range(len(times))], "each millisecond once"
        assert 1000 * times[-1] >= before


def test_mistakes_of_a_world_stand_at_their_place(studio: Studio) -> None:
    page = studio.page
    name_text(studio, "stage.toml", "[stage]\nleft = 500\nrihgt = 100\n")
    messages = page.get_by_role("list", name="Messages")
    expect(messages).to_contain_text("3: ")
    expect(messages).to_contain_text("unknown field `rihgt`")
    expect(page.get_by_role("status", name="Memory")).to_have_text("no world of this product")
    # It depends on the product that is chosen, and on that which is there.
    studio.program("[[axis]]\n[[axis]]\n")
    expect(messages).to_contain_text("this is [[axis]] number 2, and the TMCM-1140 has")
    page.get_by_label("Virtual module", exact=True).select_option("6110")
    expect(page.get_by_role("status", name="Memory")).to_have_text("a world of this product")
    # What cannot be is refused when it is started, too.
    page.get_by_label("Virtual module", exact=True).select_option("1140")
    page.get_by_role("combobox", name="World").select_option("stage.toml")
    studio.button("Start").click()
    expect(studio.link).to_contain_text("not started: the world: line 2: this is [[axis]] number 2")
    page.get_by_role("combobox", name="World").select_option("")
    studio.start()


def test_what_a_module_stores_is_kept(in_chromium: Studio, tmp_path: Path) -> None:
    studio = in_chromium
    page = studio.page
    choice = page.get_by_role("combobox", name="EEPROM")
    told = page.get_by_role("status", name="EEPROM")
    expect(choice.get_by_role("option")).to_have_text(["as it leaves the factory"])
    studio.start("3110")
    studio.send("SAP 4, 2, 321")
    studio.line.fill("STAP 4, 2")
    studio.line.press("Enter")
    page.get_by_role("dialog").get_by_role("button", name="Send").click()
    expect(studio.replies.last).to_contain_text("STAP 4, 2")
    expect(choice.get_by_role("option")).to_have_text(["as it was left", "as it leaves the factory"])
    with page.expect_download() as got:
        studio.button("Save EEPROM").click()
    assert got.value.suggested_filename == "tmcm3110.eeprom"
    file = tmp_path / "tmcm3110.eeprom"
    file.write_bytes(Path(got.value.path()).read_bytes())
    # At the next visit it is there; `tmcl sim` has the same of the file.
    page.reload()
    again = Studio(page)
    page.get_by_label("Virtual module", exact=True).select_option("3110")
    expect(choice).to_have_value("kept")
    again.start("3110")
    assert again.send("GAP 4, 2").startswith("GAP 4, 2: 321 ")
    with VirtualModule(tmp_path / "port", tmp_path, "--product", "3110", "--eeprom", str(file)) as module:
        assert "GAP 4, 2: 321 " in tmcl("send", str(module.serial), "GAP 4, 2")
    # A fresh one does not know it, and does not overwrite it.
    choice.select_option("fresh")
    again.start("3110")
    assert not again.send("GAP 4, 2").startswith("GAP 4, 2: 321 ")
    expect(told).to_have_text("what this module stores is not kept: another EEPROM is")
    again.control("send SAP 4, 2, 99")
    again.control("send STAP 4, 2")
    choice.select_option("kept")
    again.start("3110")
    assert again.send("GAP 4, 2").startswith("GAP 4, 2: 321 ")
    # Another tab may have the same one: it is told.
    second = page.context.new_page()
    second.goto(page.url)
    other = Studio(second)
    second.get_by_label("Virtual module", exact=True).select_option("3110")
    other.start("3110")
    other.control("send SAP 4, 2, 777")
    other.control("send STAP 4, 2")
    expect(told).to_contain_text("another tab keeps this EEPROM now")
    second.close()
    studio.button("Erase EEPROM").click()
    page.get_by_role("dialog").get_by_role("button", name="Erase").click()
    expect(told).to_contain_text("as it leaves the factory")
    expect(choice.get_by_role("option")).to_have_text(["as it leaves the factory"])
    # The module that runs does not bring it back.
    again.control("send SAP 4, 2, 55")
    again.control("send STAP 4, 2")
    again.control("power off")
    expect(studio.link).to_have_text("the module has no power")
    again.control("power on")
    again.is_there("3110")
    expect(choice.get_by_role("option")).to_have_text(["as it leaves the factory"])
    # The file is opened for another product, whose EEPROM has another size, and for its own.
    for product, words in (
        ("1140", "and that of a TMCM-1140 has"),
        ("3110", "the next TMCM-3110 that is started has it"),
    ):
        page.get_by_label("Virtual module", exact=True).select_option(product)
        with page.expect_file_chooser() as chooser:
            studio.button("Open EEPROM").click()
        content = file.read_bytes() if product == "3110" else file.read_bytes()[:100]
        (tmp_path / "opened.eeprom").write_bytes(content)
        chooser.value.set_files(tmp_path / "opened.eeprom")
        expect(told).to_contain_text(words)
    again.start("3110")
    assert again.send("GAP 4, 2").startswith("GAP 4, 2: 321 ")


MUTATIONS = """async () => {
    const changed = [];
    const observer = new MutationObserver((list) => changed.push(...list.map(({ target, type, attributeName }) =>
        `${target.nodeName} ${target.className ?? ''} ${type} ${attributeName ?? ''}`)));
    observer.observe(document, { subtree: true, childList: true, attributes: true, characterData: true });
    for (let frame = 0; frame < 30; frame++) {
        await new Promise((next) => requestAnimationFrame(next));
    }
    await new Promise((next) => setTimeout(next, 300));
    return [...new Set([...changed, ...observer.takeRecords().map(({ target }) => target.nodeName)])];
}"""


def test_what_stands_still_is_not_painted_anew(in_chromium: Studio) -> None:
    """A browser lays out and paints what is written, also where it is what stands there."""
    in_chromium.start()
    in_chromium.is_read()
    in_chromium.control("pause")
    expect(in_chromium.page.get_by_role("status", name="Virtual time")).to_contain_text("paused")
    expect(in_chromium.answers.last).to_contain_text("pause")
    assert in_chromium.page.evaluate(MUTATIONS) == []
    in_chromium.control("press left")
    in_chromium.control("resume")
    expect(in_chromium.page.get_by_role("button", name="Pause time")).to_have_attribute("aria-pressed", "false")
    # Time goes on, and what has come of the switch may be told meanwhile.
    assert not [place for place in in_chromium.page.evaluate(MUTATIONS) if "attributes" in place]
