"""What axe-core, a checker of accessibility, has to say; and the page by keyboard alone."""

from __future__ import annotations

import pytest
from axe_playwright_python.sync_playwright import Axe  # type: ignore[import-untyped]
from bed.browser import Browser
from bed.server import Site
from playwright.sync_api import Page, expect
from studio import SMALL, Studio, link


def violations(page: Page) -> list[str]:
    """What axe-core finds, each as its rule and the first place."""
    found = Axe().run(page).response["violations"]
    return [f"{one['id']}: {one['help']}: {one['nodes'][0]['html'][:200]}" for one in found]


def tab_to(page: Page, name: str) -> None:
    """Goes on by the tabulator key until something of this name has the focus."""
    seen = []
    for _ in range(400):
        page.keyboard.press("Tab")
        at = page.evaluate(
            """() => {
                const { labels, textContent, placeholder } = document.activeElement;
                const spoken = document.activeElement.getAttribute("aria-label");
                return spoken ?? labels?.[0]?.textContent ?? (textContent || placeholder || "");
            }"""
        )
        seen.append(at)
        if at.strip().startswith(name):
            return
    raise AssertionError(f"{name} is not among {seen}")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1400, 360])
def test_nothing_is_in_the_way(plain_chromium: Browser, studio_site: Site, scheme: str, width: int) -> None:
    context = plain_chromium.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page = context.new_page()
    page.goto(studio_site.url)
    studio = Studio(page)
    assert violations(page) == [], "before a module is there"
    page.get_by_label("Virtual module", exact=True).select_option("3110")
    studio.button("Start").click()
    studio.is_there("3110")
    page.evaluate("link => { location.hash = link; }", link(SMALL))
    expect(page.locator("#session article")).to_be_attached()
    parts = ["Module", "Parameters", "Scope", "Program", "Direct mode", "World", "Session"] if width < 1100 else [""]
    for part in parts:
        if part != "":
            studio.button(part).click()
        if part in ("", "Direct mode"):
            studio.send("GAP 1, 0")
            page.get_by_text("Telegrams", exact=True).click()
        if part in ("", "Program"):
            studio.load("Loop: MST 0\nJA Loop\n")
            expect(page.get_by_role("status", name="Debugger")).to_contain_text("halted")
            studio.button("Breakpoint at line 2").click()
            expect(studio.button("Remove: program.tmc, line 2")).to_be_visible()
        if part in ("", "World"):
            page.locator("summary").filter(has_text="Axis 2").click()
            page.get_by_role("switch", name="left switch, axis 2").click()
            expect(page.get_by_role("switch", name="left switch, axis 2")).to_have_attribute("aria-checked", "true")
        if part in ("", "Session"):
            page.get_by_text("Its world", exact=True).click()
        assert violations(page) == [], part


def test_a_question_is_not_in_the_way(plain_chromium: Browser, studio_site: Site) -> None:
    page = plain_chromium.open(studio_site.url)
    studio = Studio(page)
    studio.button("Forget everything").click()
    expect(page.get_by_role("dialog", name="Forget everything?")).to_be_visible()
    assert violations(page) == []
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_have_count(0)


def test_a_world_and_a_session_by_keyboard(plain_chromium: Browser, studio_site: Site) -> None:
    """Touch, hold time, and run a session, with no hand at the mouse."""
    page = plain_chromium.open(studio_site.url + link(SMALL))
    studio = Studio(page)
    tab_to(page, "Start")
    page.keyboard.press("Enter")
    studio.is_there("1140")
    tab_to(page, "Pause time")
    page.keyboard.press("Enter")
    expect(page.get_by_role("status", name="Virtual time")).to_contain_text("paused")
    tab_to(page, "left switch")
    page.keyboard.press("Space")
    expect(page.get_by_role("switch", name="left switch")).to_have_attribute("aria-checked", "true")
    tab_to(page, "load")
    page.keyboard.type("0.25\n")
    expect(studio.row("Axis 0", "load")).to_have_text("0.25")
    tab_to(page, "Run session")
    page.keyboard.press("Enter")
    expect(page.get_by_role("status", name="Progress of the session")).to_contain_text("the session has ended")
    tab_to(page, "Take over")
    page.keyboard.press("Enter")
    studio.is_there("1140")


def test_from_connecting_to_stop_by_keyboard(plain_chromium: Browser, studio_site: Site) -> None:
    """Connect, edit, load, break, watch, change a parameter, and STOP, with no hand at the mouse."""
    page = plain_chromium.open(studio_site.url)
    studio = Studio(page)

    tab_to(page, "Start")
    page.keyboard.press("Enter")
    studio.is_there("1140")
    tab_to(page, "Program")
    page.keyboard.press("Control+a")
    page.keyboard.type("Loop: CALC ADD, 5\nROR 0, 300\nJA Loop")
    # Arrow keys are those of the list of completions as long as it is there.
    expect(page.get_by_role("listbox", name="Completions")).to_be_hidden()
    page.keyboard.press("ArrowUp")
    page.keyboard.press("F9")
    expect(studio.button("Breakpoint at line 2")).to_have_attribute("aria-pressed", "true")
    tab_to(page, "Load program")
    page.keyboard.press("Enter")
    expect(page.get_by_role("status", name="Debugger")).to_have_text("halted at line 1")
    page.keyboard.press("F8")
    expect(page.get_by_role("status", name="Debugger")).to_have_text("halted at line 2")
    tab_to(page, "Line of the debugger")
    page.keyboard.type("watch acc\n")
    expect(studio.row("Watched", "acc")).to_have_text("5")
    page.keyboard.press("F11")
    tab_to(page, "Command")
    page.keyboard.type("SAP 4, 0, 777\n")
    expect(studio.replies).to_contain_text("status 100 ok")
    page.keyboard.press("Escape")
    expect(studio.danger).to_have_text("")
    assert studio.send("GAP 2, 0").startswith("GAP 2, 0: 0 int")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_forced_colours_and_reduced_motion(plain_chromium: Browser, studio_site: Site, scheme: str) -> None:
    context = plain_chromium.new_context(forced_colors="active", reduced_motion="reduce", color_scheme=scheme)
    page = context.new_page()
    page.goto(studio_site.url)
    studio = Studio(page)
    studio.start()
    stop = studio.button("STOP")
    assert stop.evaluate("element => getComputedStyle(element).borderTopWidth") == "3px"
    studio.program("ROR 0, 500\n")
    colours = page.get_by_role("textbox", name="Program").evaluate(
        "element => [getComputedStyle(element).color, getComputedStyle(element).backgroundColor]"
    )
    assert colours[0] != colours[1], "the text can be read"
