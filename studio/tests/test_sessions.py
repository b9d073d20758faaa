"""Sessions: what was done to a virtual module, as a file and as a link, and done again."""

from __future__ import annotations

import base64
import copy
import json
import re
import subprocess
import zlib
from pathlib import Path
from typing import Any

import pytest
from bed import PATIENCE
from bed.browser import Browser
from bed.module import ROOT, VirtualModule
from bed.server import Site
from playwright.sync_api import Locator, expect
from studio import FOLDER, SMALL, Studio, link, tmcl

HERE = Path(__file__).parent
DOCS = ROOT / "docs" / "studio.md"
PRODUCTS = {"1110": 0, "1140": 0, "3110": 2, "3212": 2, "6110": 5}


def told(studio: Studio) -> Locator:
    """What there is to say about sessions."""
    return studio.page.get_by_role("status", name="Session", exact=True)


def progress(studio: Studio) -> Locator:
    """What there is to say about the session that is run."""
    return studio.page.get_by_role("status", name="Progress of the session")


def opened(studio: Studio) -> Locator:
    """The session that is shown."""
    return studio.page.get_by_role("article")


def saved(studio: Studio, button: str) -> str:
    """The text of the file that a button saves."""
    with studio.page.expect_download() as got:
        studio.button(button).click()
    return Path(got.value.path()).read_text()


def open_file(studio: Studio, path: Path) -> None:
    """Opens a file as a session."""
    with studio.page.expect_file_chooser() as chooser:
        studio.button("Open session").click()
    chooser.value.set_files(path)


def run(studio: Studio) -> None:
    """Runs the session that is shown, to its end, as fast as the computer can."""
    studio.button("Run session").click()
    expect(studio.link).to_have_text("shown")
    studio.control("speed max")
    expect(progress(studio)).to_have_text('the session has ended: "Take over" goes on from here')


@pytest.mark.parametrize("product", PRODUCTS)
def test_the_same_numbers_everywhere(
    plain_chromium: Browser, plain_firefox: Browser, studio_site: Site, tmp_path: Path, product: str
) -> None:
    """By hand in Chromium; then again in Chromium, in Firefox, in Node, and by `tmcl test`."""
    last = PRODUCTS[product]
    studio = Studio(plain_chromium.open(studio_site.url))
    studio.page.get_by_role("textbox", name="Title").fill(f"Turns of a {product}")
    studio.start(product)
    for curve in (f"rotor {last}" if last else "rotor", "switches.left", f"GAP 1, {last}"):
        studio.page.get_by_role("combobox", name="Curve", exact=True).fill(curve)
        studio.button("Add curve").click()
        expect(studio.page.get_by_role("combobox", name="Curve", exact=True)).to_have_value("")
    speed = 60_000 if product == "3212" else 500
    studio.send(f"ROR {last}, {speed}")
    studio.load(f"Loop: ROL 0, {speed}\nWAIT TICKS, 0, 2\nROR 0, {speed}\nWAIT TICKS, 0, 3\nJA Loop")
    studio.button("Run").click()
    studio.control(f"load 0.3 {last}")
    studio.control("press left")
    studio.control("at 20 ms release left")
    studio.control("pause")
    studio.control("step 300 ms")
    studio.send(f"MVP ABS, {last}, 4000")
    studio.control("step 150 ms")
    studio.button("Stop program").click()
    studio.control("step 30 ms")
    by_hand = saved(studio, "CSV of all rows")
    text = saved(studio, "Save session")
    session = json.loads(text)
    assert session["session"] == 1
    assert session["title"] == f"Turns of a {product}"
    assert [entry["name"] for entry in session["texts"]] == ["program.tmc"]
    file = tmp_path / "session.json"
    file.write_text(text)

    samples = []
    for browser in (plain_chromium, plain_firefox):
        again = Studio(browser.open(studio_site.url))
        open_file(again, file)
        run(again)
        samples.append(saved(again, "CSV of all rows") if browser.name == "chromium" else rows(again))
        # Its module would run on beside the others.
        again.page.close()
    node = subprocess.run(
        ["node", HERE / "play.mjs", FOLDER, file], check=True, capture_output=True, text=True, timeout=PATIENCE
    )
    assert samples[0].count("\n") == session["until"] // 1000 - first(samples[0]) + 2
    assert samples[0].splitlines() == node.stdout.splitlines()
    assert samples[1].splitlines() == node.stdout.splitlines()
    # As it was by hand, from the moment on at which these curves were looked at.
    head, *lines = by_hand.splitlines()
    assert head == samples[0].splitlines()[0]
    whole = [line for line in lines if "" not in line.split(",")]
    assert len(whole) > 400
    assert set(whole) <= set(samples[0].splitlines())

    scenario = tmp_path / "session.txt"
    scenario.write_text(saved(studio, "As a scenario"))
    assert "== Turns of a " + product in scenario.read_text()
    assert scenario.read_text().count("\nexpect rotor") > 4
    assert "1 passed, 0 failed" in tmcl("test", str(scenario))


def first(csv: str) -> int:
    """The millisecond of the first row."""
    return int(float(csv.splitlines()[1].split(",")[0]))


def rows(studio: Studio) -> str:
    """The same file where Playwright gets hold of none: Firefox of a distribution."""
    studio.page.evaluate(
        """() => {
            globalThis.saved = new Promise(done => {
                URL.createObjectURL = blob => (blob.text().then(done), '#');
            });
        }"""
    )
    studio.button("CSV of all rows").click()
    text: str = studio.page.evaluate("saved")
    return text


def test_a_link_shows_a_session_and_does_nothing(studio: Studio, studio_site: Site) -> None:
    page = studio.page
    page.goto(studio_site.url + link(SMALL))
    page.reload()
    expect(told(studio)).to_have_text("the link: opened; nothing is done until it is run")
    expect(opened(studio).get_by_role("heading")).to_have_text("A turn, and a hand")
    expect(opened(studio)).to_contain_text(
        "A virtual TMCM-1140, as it leaves the factory: 0.900 s, in which there are 2 deeds and 1 reading."
    )
    expect(opened(studio).get_by_role("listitem")).to_have_text(["0.050 s  MVP REL, 0, 12800", "0.700 s  press left"])
    expect(studio.module).to_have_text("no module")
    expect(studio.page.get_by_role("textbox", name="Program", exact=True)).not_to_have_value(
        "// of the session\nSTOP\n"
    )
    run(studio)
    expect(studio.module).to_have_text("TMCM-1140, to which a session is done")
    expect(studio.row("Axis 0", "rotor (1/256 full steps)")).to_have_text("12800")
    expect(page.get_by_role("switch", name="left switch")).to_have_attribute("aria-checked", "true")
    expect(studio.button("Send")).to_be_disabled()
    studio.button("Take over").click()
    studio.is_there("1140")
    studio.control("pause")
    assert studio.send("GAP 1, 0").startswith("GAP 1, 0: 12800 ")
    # Its texts are added when that is wanted, beside those of the user.
    studio.button("Add its texts").click()
    expect(told(studio)).to_have_text("added: program-2.tmc")
    expect(page.get_by_role("combobox", name="Text", exact=True).get_by_role("option")).to_have_text(
        ["program-2.tmc", "program.tmc"]
    )


def test_a_link_opens_with_the_network_cut_off(plain_chromium: Browser, studio_site: Site) -> None:
    """A page that is there needs nobody any more."""
    studio = Studio(plain_chromium.open(studio_site.url))
    # The workers of a link are loaded with the first one.
    studio.start()
    studio.page.context.set_offline(True)
    studio.page.evaluate("link => { location.hash = link; }", link(SMALL))
    expect(opened(studio).get_by_role("heading")).to_have_text("A turn, and a hand")
    run(studio)


def test_what_is_done_is_copied_as_a_link(plain_chromium: Browser, studio_site: Site) -> None:
    context = plain_chromium.new_context(permissions=["clipboard-read", "clipboard-write"])
    page = context.new_page()
    page.goto(studio_site.url)
    studio = Studio(page)
    studio.start()
    studio.is_read()
    studio.send("MVP ABS, 0, 5000")
    studio.control("pause")
    studio.control("run-until position = 5000 max 5 s")
    studio.button("Copy link").click()
    expect(told(studio)).to_contain_text("copied: a link of ")
    copied: str = page.evaluate("navigator.clipboard.readText()")
    assert copied.startswith(studio_site.url + "#session=")
    assert len(copied) < 4000, "all parameters that the page has read, and a move"
    other = Studio(plain_chromium.open(copied))
    run(other)
    expect(other.row("Axes", "actual position (microsteps)")).to_have_text("5000")
    # What is too long for a link is told.
    studio.program("// " + "".join(str(number) for number in range(9000)))
    studio.button("Copy link").click()
    expect(told(studio)).to_contain_text("and 8000 are the most: save it as a file")


def test_what_was_done_to_the_session_before_takes_over_no_other(in_chromium: Studio) -> None:
    studio = in_chromium
    studio.page.evaluate("link => { location.hash = link; }", link(changed(until=600_000_000)))
    studio.button("Run session").click()
    expect(progress(studio)).to_contain_text("s of the session are left")
    switch, again = studio.page.get_by_role("switch", name="left switch"), studio.button("Run session")
    switch.evaluate("(switch_, again) => { switch_.click(); again.click(); }", again.element_handle())
    expect(studio.link).to_have_text("shown")
    expect(studio.button("Take over")).to_be_enabled()
    expect(progress(studio)).to_contain_text("s of the session are left")
    # But after STOP no session begins that was asked for before.
    stop = studio.button("STOP").element_handle()
    again.evaluate("(again_, stop) => { again_.click(); stop.click(); }", stop)
    studio.is_there("1140")
    expect(progress(studio)).to_have_text("the session was taken over")
    expect(studio.row("Axes", "actual speed (int)")).to_have_text("0")


def test_who_does_something_takes_over(studio: Studio, studio_site: Site) -> None:
    long = copy.deepcopy(SMALL) | {"until": 600_000_000, "done": ["50000 ROR 0, 300", "500000000 MST 0"]}
    page = studio.page
    page.evaluate("link => { location.hash = link; }", link(long))
    studio.button("Run session").click()
    expect(progress(studio)).to_contain_text("s of the session are left")
    # Time is no deed: it may be held.
    studio.control("pause")
    expect(progress(studio)).to_contain_text("s of the session are left")
    studio.control("step 2 s")
    studio.control("resume")
    page.get_by_role("switch", name="left switch").click()
    studio.is_there("1140")
    expect(progress(studio)).to_have_text("the session was taken over")
    # STOP does as well.
    studio.button("Run session").click()
    expect(studio.row("Axes", "actual speed (int)")).to_have_text("300")
    studio.button("STOP").click()
    studio.is_there("1140")
    expect(studio.row("Axes", "actual speed (int)")).to_have_text("0")


def test_a_session_that_is_run_is_not_the_one_that_is_shown(in_chromium: Studio) -> None:
    """What is run goes on, and can be taken over, whatever is shown; and what is wrong with another one is told."""
    studio = in_chromium
    long = changed(until=600_000_000, done=["50000 ROR 0, 300"], title="Long")
    take = studio.button("Take over")
    expect(take).to_be_disabled()
    studio.page.evaluate("link => { location.hash = link; }", link(long))
    studio.button("Run session").click()
    expect(take).to_be_enabled()
    studio.page.evaluate("link => { location.hash = link; }", "#session=AAAA")
    expect(told(studio)).to_contain_text("the link: this link")
    expect(progress(studio)).to_contain_text("s of the session are left")
    expect(told(studio)).to_contain_text("the link: this link")
    studio.page.evaluate("link => { location.hash = link; }", link(SMALL))
    expect(opened(studio).get_by_role("heading")).to_have_text("A turn, and a hand")
    studio.button("Close").click()
    expect(opened(studio)).to_have_count(0)
    expect(told(studio)).to_have_text("")
    assert studio.page.evaluate("location.hash") == ""
    take.click()
    studio.is_there("1140")
    expect(take).to_be_disabled()
    # Something else takes its place.
    for end in ("Start", "Disconnect"):
        studio.page.evaluate("link => { location.hash = link; }", link(long))
        studio.button("Run session").click()
        expect(progress(studio)).to_contain_text("s of the session are left")
        studio.button(end).click()
        expect(progress(studio)).to_have_text("the session was ended: something else has its place")
        expect(take).to_be_disabled()
        studio.page.evaluate("history.back()")
        expect(opened(studio)).to_have_count(0)


def test_a_session_without_a_cable_is_taken_over_when_it_is_there(in_chromium: Studio) -> None:
    studio = in_chromium
    studio.page.evaluate("link => { location.hash = link; }", link(changed(done=["50 usb off"])))
    run(studio)
    studio.button("Take over").click()
    expect(studio.link).to_contain_text("asking again each second")
    studio.control("usb on")
    studio.is_there("1140")


def test_a_link_is_shown_in_a_narrow_window(plain_chromium: Browser, studio_site: Site) -> None:
    page = plain_chromium.new_context(viewport={"width": 360, "height": 640}).new_page()
    page.goto(studio_site.url + link(SMALL))
    expect(page.get_by_role("article").get_by_role("heading")).to_be_visible()


def test_another_version_is_told_first(in_chromium: Studio) -> None:
    other = SMALL | {"made": {"version": "9.9.9", "hash": "0123456789abcdef"}}
    in_chromium.page.evaluate("link => { location.hash = link; }", link(other))
    expect(opened(in_chromium)).to_contain_text(
        "It was made by another version of this page (9.9.9, 0123456789abcdef; this is "
    )
    in_chromium.page.evaluate("link => { location.hash = link; }", link(SMALL))
    expect(opened(in_chromium)).not_to_contain_text("another version")


def test_a_module_at_a_port_is_left_alone(
    chromium: Browser, module: VirtualModule, studio_site: Site, site: Site
) -> None:
    for file in FOLDER.rglob("*"):
        if file.is_file():
            target = site.folder / file.relative_to(FOLDER)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(file.read_bytes())
    studio = Studio(chromium.open(site.url))
    studio.connect()
    studio.page.evaluate("link => { location.hash = link; }", link(SMALL))
    studio.button("Run session").click()
    expect(told(studio)).to_contain_text("a real module is connected: disconnect it before a session is run")
    studio.is_there("1140")
    assert studio.send("GAP 1, 0").startswith("GAP 1, 0: 0 ")


def links() -> dict[str, str]:
    """The links of the examples, as the documentation has them."""
    found = re.findall(r"^\[(\w+)\]\(\.\./examples/.*\n\n {4}(#session=\S+)$", DOCS.read_text(), re.MULTILINE)
    assert len(found) == len(list((ROOT / "examples").glob("*.tmc")))
    return dict(found)


def test_the_links_of_the_documentation(studio: Studio) -> None:
    for name, behind in links().items():
        assert len(behind) <= 8000
        studio.page.evaluate("link => { location.hash = link; }", behind)
        expect(opened(studio).get_by_role("heading")).to_have_text(f"The example {name}")
    studio.page.evaluate("link => { location.hash = link; }", links()["there_and_back"])
    expect(opened(studio).get_by_role("heading")).to_have_text("The example there_and_back")
    run(studio)
    expect(studio.row("Axis 0", "rotor (1/256 full steps)")).not_to_have_text("0")


def changed(**fields: Any) -> dict[str, Any]:
    """The small session with other fields."""
    return copy.deepcopy(SMALL) | fields


@pytest.mark.parametrize(
    ("session", "words"),
    [
        (changed(session=2), "of a later version of this page (2); this one reads up to 1"),
        (json.dumps(SMALL)[:200], "no session of this page, or was cut off"),
        (changed(more=1), "unknown field `more`"),
        (changed(start=SMALL["start"] | {"world": "[[axis]]\n[[axis]]\n"}), "the world: line 2"),
        (changed(start=SMALL["start"] | {"product": "4711"}), "4711"),
        (
            changed(start=SMALL["start"] | {"eeprom": "ff" * 100}),
            "the EEPROM: there are 100 bytes, and that of a TMCM-1140 has",
        ),
        (changed(done=["5 GOTO 1"]), "what is done as number 1: GOTO 1"),
        (changed(done=["5 MST 0", "4 MST 0"]), "is before what is done before it"),
        (changed(curves=["GAP 1, 7"]), "no axis 7"),
        (changed(title="x" * 200), "its title has 200 characters"),
        (" " * 9_000_000, "more than 8000000 bytes when it is unpacked"),
        ("[" * 1_000_000, "no session of this page"),
        ("", "no session of this page"),
    ],
)
def test_what_is_no_session_is_told(in_chromium: Studio, session: object, words: str) -> None:
    studio = in_chromium
    studio.page.evaluate("link => { location.hash = link; }", link(session))
    expect(told(studio)).to_contain_text(words)
    expect(opened(studio)).to_have_count(0)
    studio.start()


def test_a_link_that_unpacks_to_a_gigabyte_is_not_unpacked(studio: Studio) -> None:
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    # Each megabyte stands for itself, so that one is packed and all others are the same bytes.
    megabyte = packer.compress(bytes(1 << 20)) + packer.flush(zlib.Z_FULL_FLUSH)
    # Firefox takes no address of more than a million characters.
    megabytes = 700 if studio.page.context.browser.browser_type.name == "firefox" else 1024  # type: ignore[union-attr]
    packed = megabytes * megabyte + packer.flush()
    text = "#session=" + base64.urlsafe_b64encode(packed).decode().rstrip("=")
    studio.page.evaluate("link => { location.hash = link; }", text)
    expect(told(studio)).to_contain_text("more than 8000000 bytes when it is unpacked")


@pytest.mark.parametrize(
    "behind", ["#session=%%%", "#session=A", "#session=AAAA", "#session=" + link(SMALL)[9:60], "#session=\u00e9"]
)
def test_a_link_that_was_changed_is_told(in_chromium: Studio, behind: str) -> None:
    in_chromium.page.evaluate("link => { location.hash = link; }", behind)
    expect(told(in_chromium)).to_contain_text("the link: this link")


def test_names_and_words_are_text(studio: Studio) -> None:
    evil = "<img src=x onerror=alert(1)>"
    session = changed(title=evil, texts=[{"name": evil, "text": evil}], made={"version": evil, "hash": evil})
    studio.page.evaluate("link => { location.hash = link; }", link(session))
    expect(opened(studio).get_by_role("heading")).to_have_text(evil)
    studio.button("Add its texts").click()
    expect(told(studio)).to_have_text(f"added: {evil}")
    assert studio.page.locator("img").count() == 0


def test_changed_links_end_with_words_or_a_picture(plain_chromium: Browser, studio_site: Site) -> None:
    """A few hundred through the front door; ten thousand are tested with the doors themselves."""
    page = plain_chromium.context.new_page()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(studio_site.url)
    studio = Studio(page)
    kinds: dict[str, int] = studio.page.evaluate(
        """async text => {
            const kinds = { words: 0, picture: 0 };
            const { pack } = await import('./session-link.js');
            const status = document.querySelector('[role=status][aria-label=Session]');
            let seed = 1;
            const random = below => {
                seed = (Math.imul(seed, 1103515245) + 12345) >>> 0;
                return (seed >>> 8) % below;
            };
            for (let turn = 0; turn < 300; turn += 1) {
                const letters = [...text];
                for (let change = random(3); change >= 0; change -= 1) {
                    const at = random(letters.length);
                    const other = String.fromCharCode(32 + random(95));
                    if (random(3) === 0) {
                        letters.splice(at, random(9));
                    } else {
                        letters[at] = random(2) ? other : letters[random(letters.length)];
                    }
                }
                const link = await pack(letters.join(''));
                const behind = random(4) === 0 ? link.slice(0, 10 + random(link.length - 10)) : link;
                status.textContent = '';
                location.hash = '#';
                location.hash = behind;
                while (status.textContent === '') {
                    await new Promise(done => setTimeout(done, 2));
                }
                const isShown = document.querySelector('#session article') !== null;
                kinds[isShown ? 'picture' : 'words'] += 1;
            }
            return kinds;
        }""",
        json.dumps(SMALL),
    )
    assert kinds["words"] > 50
    assert kinds["picture"] > 20
    studio.start()
    assert all(url.startswith((studio_site.url, "blob:", "data:")) for url in asked), "nobody else is asked"
