"""A virtual module in the page, which is served as any web server would."""

from __future__ import annotations

import shutil

import pytest
from bed.browser import Browser
from bed.server import Site
from playwright.sync_api import expect
from studio import FOLDER, Studio, tmcl

PRODUCTS = ["1110", "1140", "3110", "3212", "6110"]


@pytest.mark.parametrize("product", PRODUCTS)
def test_replies_are_in_the_words_of_the_program(plain_chromium: Browser, studio_site: Site, product: str) -> None:
    studio = Studio(plain_chromium.open(studio_site.url))
    studio.start(product)
    lines = ["GAP 1, 0", "SAP 4, 0, 500", "GAP APMaxPositioningSpeed, 0", "6, 4, 0", "MST 9", "GGP 66, 0", "GAP 255, 0"]
    expected = tmcl("send", "sim", "--product", product, *lines, code=1).splitlines()
    assert [studio.send(line) for line in lines] == expected


def test_commands_move_a_motor_and_stop_ends_that(studio: Studio) -> None:
    studio.start("6110")
    assert studio.send("ROR 5, 500").endswith("status 100 ok")
    studio.control("pause")
    studio.control("step 1 s")
    assert studio.control("state")["axes"][5]["velocity"] != 0
    studio.control("resume")
    studio.page.keyboard.press("Escape")
    expect(studio.danger).to_have_text("")
    studio.control("pause")
    studio.control("step 5 s")
    state = studio.control("state")
    assert [axis["velocity"] for axis in state["axes"]] == [0] * 6
    assert state["axes"][5]["position"] > 0


def test_a_program_that_moves_motors_is_stopped(studio: Studio) -> None:
    studio.start()
    studio.page.get_by_role("textbox", name="Program").fill("Loop: ROR 0, 500\nWAIT TICKS, 0, 1\nJA Loop")
    studio.button("Load program").click()
    expect(studio.job("Load program")).to_contain_text("done")
    studio.send("129, 0, 0, 0")
    studio.button("STOP").click()
    expect(studio.danger).to_have_text("")
    studio.control("pause")
    studio.control("step 5 s")
    assert studio.control("state")["velocity"] == 0


def test_an_unanswered_stop_is_told_and_sent_again(studio: Studio) -> None:
    studio.start()
    studio.control("power off")
    studio.button("STOP").click()
    expect(studio.danger).to_contain_text("the motor may turn")
    studio.control("power on")
    expect(studio.danger).to_have_text("")


def test_switches_are_pressed_by_lines_of_the_control_port(studio: Studio) -> None:
    studio.start()
    assert studio.control("press left") == {"ok": True}
    assert studio.send("GAP 11, 0").startswith("GAP 11, 0: 1 (left limit switch state)")
    told = studio.control("fault fire on")
    assert told["ok"] is False
    assert "unknown fault 'fire'" in told["error"]


def test_time_stands_still_while_it_is_paused(studio: Studio) -> None:
    studio.start()
    studio.control("pause")
    before = studio.control("state")["time_us"]
    assert studio.control("state")["time_us"] == before
    assert studio.control("step 20 ms")["time_us"] == before + 20_000


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("dance", "unknown command 'dance'"),
        ("GAP 1099511627776, 0", "does not fit 32 bits"),
        ("SAP 4, 0, 99999999999", "does not fit 32 bits"),
        ("<img src=x onerror=alert(1)>", "<img"),
        ("GAP \u001b[2J, 0", "GAP"),
    ],
)
def test_what_is_no_command_is_told(plain_chromium: Browser, studio_site: Site, line: str, words: str) -> None:
    studio = Studio(plain_chromium.open(studio_site.url))
    studio.start()
    assert words in studio.send(line)
    assert studio.page.locator("img").count() == 0
    assert studio.send("GAP 1, 0").endswith("status 100 ok"), "the page goes on"


def test_mistakes_of_a_program_have_their_place(studio: Studio) -> None:
    studio.start()
    studio.page.get_by_role("textbox", name="Program").fill("Speed = 5\nROR 0, Speeed")
    studio.button("Load program").click()
    told = studio.page.get_by_role("status", name="Loading")
    expect(told).to_contain_text("program.tmc:2:8: error: unknown name 'Speeed'; did you mean 'Speed'?")


def test_settings_are_those_of_the_program(plain_chromium: Browser, studio_site: Site) -> None:
    """Where Playwright gets hold of files that are saved."""
    studio = Studio(plain_chromium.open(studio_site.url))
    studio.start("3110")
    with studio.page.expect_download() as download:
        studio.button("Export").click()
    text = download.value.path().read_text()
    expected = tmcl("params", "sim", "save", "-", "--product", "3110").rstrip()
    # The program has been told the product, so that only the page knows the version of the firmware.
    assert text.rstrip().splitlines()[1:] == expected.splitlines()[1:]


def test_earlier_lines_come_back(studio: Studio) -> None:
    studio.start()
    studio.send("GAP 1, 0")
    studio.send("GAP 3, 0")
    for key, line in (("ArrowUp", "GAP 3, 0"), ("ArrowUp", "GAP 1, 0"), ("ArrowDown", "GAP 3, 0"), ("ArrowDown", "")):
        studio.line.press(key)
        expect(studio.line).to_have_value(line)


def test_values_of_each_axis_are_shown_and_not_announced(studio: Studio) -> None:
    studio.start("3110")
    table = studio.page.get_by_role("table", name="Axes")
    assert table.get_attribute("aria-live") == "off"
    expect(table.get_by_role("row")).to_have_count(6)
    studio.send("SAP 1, 2, 777")
    expect(table.get_by_role("row").filter(has_text="position 2").get_by_role("cell")).to_have_text("777")


def test_replies_are_announced_and_samples_are_not(plain_chromium: Browser, studio_site: Site) -> None:
    """As the browser tells programs that read a page aloud."""
    studio = Studio(plain_chromium.open(studio_site.url))
    studio.start()
    studio.send("GAP 1, 0")
    nodes = studio.page.context.new_cdp_session(studio.page).send("Accessibility.getFullAXTree")["nodes"]
    spoken = {}
    for node in nodes:
        told = {entry["name"]: entry["value"].get("value") for entry in node.get("properties", [])}
        if told.get("live", "off") != "off":
            spoken[node.get("name", {}).get("value")] = told["live"]
    assert spoken.pop("") == "assertive", "the danger"
    assert set(spoken.values()) == {"polite"}
    read_aloud = {"Announced", "Answers", "Curve", "Debugged", "Debugger", "EEPROM", "Explanation", "Link", "Loading"}
    read_aloud |= {"Flash image", "Memory", "Session"}
    read_aloud |= {"Module", "Parameters shown", "Replies", "Scope", "State of the parameters", "What is kept"}
    assert set(spoken) <= read_aloud, "no samples, nor telegrams"
    controls = {"button", "textbox", "combobox", "spinbutton", "listbox"}
    named = [node for node in nodes if not node["ignored"] and node["role"]["value"] in controls]
    assert len(named) > 10
    assert all(node["name"]["value"] for node in named), "every control has a name"


def test_any_server_offers_it_from_any_folder(plain: Browser, site: Site) -> None:
    folder = site.folder / "some" / "folder with a name"
    shutil.copytree(FOLDER, folder)
    studio = Studio(plain.open(site.url + "some/folder%20with%20a%20name/"))
    studio.start("6110")
    assert studio.send("GAP 1, 5").endswith("status 100 ok")


def test_a_module_takes_the_place_of_another(studio: Studio) -> None:
    for product in ("1140", "6110", "3212"):
        studio.start(product)
    studio.button("Disconnect").click()
    expect(studio.link).to_have_text("disconnected")
    expect(studio.button("Send")).to_be_disabled()


def test_when_the_tools_die_link_and_stop_do_not_notice(plain_chromium: Browser, studio_site: Site) -> None:
    plain_chromium.allow("stand-in")
    studio = Studio(plain_chromium.open(studio_site.url))
    studio.start()
    studio.send("ROR 0, 500")
    tools = studio.page.workers[0]
    tools.evaluate("setTimeout(() => { throw new Error('stand-in for a mistake'); })")
    expect(studio.replies.last).to_contain_text("the tools have ended, and are started anew: ")
    studio.button("STOP").click()
    expect(studio.danger).to_have_text("")
    studio.is_there("1140")
    assert studio.send("GAP 2, 0").startswith("GAP 2, 0: 0 int")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_narrow_window_suffices(plain_chromium: Browser, studio_site: Site, scheme: str) -> None:
    context = plain_chromium.new_context(viewport={"width": 360, "height": 640}, color_scheme=scheme, has_touch=True)
    page = context.new_page()
    page.goto(studio_site.url)
    studio = Studio(page)
    page.get_by_label("Virtual module", exact=True).select_option("6110")
    studio.button("Start").tap()
    studio.is_there("6110")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    page.mouse.wheel(0, 10_000)
    expect(studio.button("STOP")).to_be_in_viewport()
    studio.button("STOP").tap()
    expect(studio.danger).to_have_text("")


def test_by_keyboard_alone(studio: Studio) -> None:
    page = studio.page

    def tab_to(name: str) -> None:
        for _ in range(400):
            page.keyboard.press("Tab")
            if page.evaluate(
                "document.activeElement.labels?.[0]?.textContent ?? document.activeElement.textContent"
            ).startswith(name):
                return
        raise AssertionError(name)

    tab_to("STOP")
    tab_to("Virtual module")
    tab_to("Start")
    page.keyboard.press("Enter")
    studio.is_there("1140")
    tab_to("Command")
    page.keyboard.type("ROR 0, 500\n")
    expect(studio.replies).to_have_count(1)
    page.keyboard.press("Escape")
    expect(studio.danger).to_have_text("")


def test_in_a_frame_the_page_only_says_so(plain: Browser, studio_site: Site, site: Site) -> None:
    site.write(
        index__html=f"""<!doctype html><title>Elsewhere</title><link rel="icon" href="data:,">
            <iframe src="{studio_site.url}"></iframe>"""
    )
    frame = plain.open(site.url).frame_locator("iframe")
    expect(frame.get_by_text("in a window of its own only")).to_be_visible()
    expect(frame.get_by_role("button", name="STOP")).to_be_disabled()
    expect(frame.get_by_role("button", name="Start")).to_have_count(0)


def test_the_page_is_small() -> None:
    import gzip

    sizes = {path.name: len(gzip.compress(path.read_bytes(), 9)) for path in FOLDER.rglob("*") if path.is_file()}
    # This one is loaded when an image is opened.
    image = sizes.pop("tmcl_studio_image.wasm")
    assert sum(sizes.values()) <= 850_000, sizes
    assert image <= 900_000
