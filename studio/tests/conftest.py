"""What a test can ask for, each of its own and gone when it is over: servers, a virtual module, browsers."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
from bed import PATIENCE
from bed import browser as browsers
from bed.browser import Browser
from bed.module import VirtualModule
from bed.namespace import compile_library
from bed.server import Elsewhere, Site
from playwright.sync_api import Browser as Driven
from playwright.sync_api import Playwright, expect, sync_playwright
from studio import FOLDER, Studio

# A busy computer is slow.
expect.set_options(timeout=1000 * PATIENCE)


@pytest.fixture(scope="session")
def playwright() -> Iterator[Playwright]:
    """What drives the browsers. A thread has one at a time."""
    with sync_playwright() as playwright:
        yield playwright


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The stand-in for libudev."""
    return compile_library(tmp_path_factory.mktemp("libudev"))


@pytest.fixture
def ports(tmp_path: Path) -> Path:
    """A folder whose entries are the serial ports of all browsers of the test."""
    folder = tmp_path / "ports"
    folder.mkdir()
    return folder


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    """A plain web server for the files of the folder `site.folder`."""
    folder = tmp_path / "site"
    folder.mkdir()
    with Site(folder) as site:
        yield site


@pytest.fixture
def studio_site() -> Iterator[Site]:
    """A plain web server with the page of the studio."""
    if not (FOLDER / "index.html").exists():
        raise FileNotFoundError(f"{FOLDER} has no page: `cargo studio --build` makes it")
    with Site(FOLDER) as site:
        yield site


@pytest.fixture
def elsewhere() -> Iterator[Elsewhere]:
    """A server of another origin, which nothing is to reach."""
    with Elsewhere() as elsewhere:
        yield elsewhere


@pytest.fixture
def module(tmp_path: Path, ports: Path) -> Iterator[VirtualModule]:
    """A virtual TMCM-1140 at the serial port ttyACM0."""
    with VirtualModule(ports / "ttyACM0", tmp_path) as module:
        yield module


@pytest.fixture
def chromium(playwright: Playwright, tmp_path: Path, library: Path, ports: Path, site: Site) -> Iterator[Browser]:
    """Chromium, in which the pages of `site` have all serial ports by getPorts()."""
    with browsers.chromium(playwright, tmp_path, library, ports, origins=[site.origin]) as browser:
        yield browser


@pytest.fixture
def firefox(playwright: Playwright, tmp_path: Path, library: Path, ports: Path) -> Iterator[Browser]:
    """Firefox ESR, which allows the first serial port to a page that asks for one by requestPort()."""
    with browsers.firefox(playwright, tmp_path, library, ports) as browser:
        yield browser


@pytest.fixture(scope="session")
def running_chromium(
    playwright: Playwright, tmp_path_factory: pytest.TempPathFactory, library: Path
) -> Iterator[Driven]:
    """A process of Chromium without serial ports."""
    folder = tmp_path_factory.mktemp("chromium")
    ports = folder / "ports"
    ports.mkdir()
    with browsers.running_chromium(playwright, folder, library, ports, program="chromium-headless-shell") as driven:
        yield driven


@pytest.fixture(scope="session")
def running_firefox(
    playwright: Playwright, tmp_path_factory: pytest.TempPathFactory, library: Path
) -> Iterator[Driven]:
    """A process of Firefox without serial ports."""
    folder = tmp_path_factory.mktemp("firefox")
    (folder / "ports").mkdir()
    with browsers.running_firefox(playwright, folder, library, folder / "ports") as driven:
        yield driven


@pytest.fixture
def plain_chromium(running_chromium: Driven) -> Iterator[Browser]:
    """Chromium without serial ports: a fresh profile in the process that tests before have had."""
    with browsers.tested("chromium", running_chromium) as browser:
        yield browser


@pytest.fixture
def plain_firefox(running_firefox: Driven) -> Iterator[Browser]:
    """Firefox without serial ports: a fresh profile in the process that tests before have had."""
    with browsers.tested("firefox", running_firefox) as browser:
        yield browser


@pytest.fixture(params=["plain_chromium", "plain_firefox"])
def plain(request: pytest.FixtureRequest) -> Browser:
    """Each of the two browsers without serial ports, one after the other."""
    browser: Browser = request.getfixturevalue(request.param)
    return browser


@pytest.fixture
def studio(plain: Browser, studio_site: Site) -> Studio:
    """The page, in either browser without serial ports."""
    return Studio(plain.open(studio_site.url))


@pytest.fixture
def in_chromium(plain_chromium: Browser, studio_site: Site) -> Studio:
    """The page, where one browser is enough."""
    return Studio(plain_chromium.open(studio_site.url))


@pytest.fixture(params=["chromium", "firefox"])
def browser(request: pytest.FixtureRequest) -> Browser:
    """Each of the two browsers, one after the other."""
    browser: Browser = request.getfixturevalue(request.param)
    return browser


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """What a browser has said fails its test while all else is still there. Of a test that has failed it is told."""
    found = {id(value): value for value in getattr(item, "funcargs", {}).values() if isinstance(value, Browser)}
    try:
        result = yield
    except BaseException:
        for browser in found.values():
            browser.checked = True
            item.add_report_section("call", browser.name, "\n".join(map(str, browser.messages)))
        raise
    for browser in found.values():
        browser.check()
    return result
