"""Makes the pictures of docs/studio.md: the page, as it is while an example is debugged.

PATH=$PWD/target/studio-venv/bin:$PATH python studio/tests/pictures.py docs/pictures
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from bed.module import ROOT
from bed.namespace import installed
from bed.server import Site
from playwright.sync_api import Browser, Page, expect, sync_playwright
from studio import FOLDER, Studio

# The program of the pictures: a motor goes to and fro, and counts how often.
PROGRAM = """// To and fro, counted
Away = 25600 // microsteps: half a revolution
Count = 42   // a user variable

Loop:   MVP ABS, 0, Away
        WAIT POS, 0, 0
        MVP ABS, 0, 0
        WAIT POS, 0, 0
        GGP Count, 2
        CALC ADD, 1
        AGP Count, 2
        JA Loop
"""


def example(page: Page, url: str) -> None:
    """The page with the program halted at a breakpoint, in time that stands still."""
    page.goto(url)
    studio = Studio(page)
    studio.start()
    studio.is_read()
    studio.load(PROGRAM)
    studio.button("Breakpoint at line 10").click()
    for _ in range(2):
        studio.button("Continue").click()
        expect(page.get_by_role("log", name="Debugged").get_by_text("breakpoint").last).to_be_visible()
        expect(page.get_by_role("status", name="Debugger")).to_have_text("halted at line 10")
    studio.send("GAP 1, 0")
    studio.control("pause")


def wide(browser: Browser, url: str, to: Path) -> None:
    """The whole page."""
    page = browser.new_page(viewport={"width": 1400, "height": 1000}, color_scheme="light")
    example(page, url)
    page.evaluate("window.scrollTo(0, 0)")
    page.screenshot(path=to / "studio.png")


def narrow(browser: Browser, url: str, to: Path) -> None:
    """Two of its parts, as a telephone shows them."""
    page = browser.new_page(viewport={"width": 1400, "height": 1000}, color_scheme="dark")
    example(page, url)
    page.set_viewport_size({"width": 390, "height": 780})
    for part in ("Scope", "Program"):
        page.get_by_role("navigation").get_by_role("button", name=part).click()
        page.evaluate("window.scrollTo(0, 0)")
        page.screenshot(path=to / f"studio-{part.lower()}.png")


def main() -> None:
    """Makes all of them."""
    to = ROOT / sys.argv[1]
    to.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright, Site(FOLDER) as site:
        browser = playwright.chromium.launch(executable_path=installed("chromium"), args=["--no-sandbox"])
        wide(browser, site.url, to)
        narrow(browser, site.url, to)
        browser.close()


if __name__ == "__main__":
    main()
