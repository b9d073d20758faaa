"""Browsers of a test, driven by Playwright, with what they say."""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from playwright.sync_api import Browser as Driven
from playwright.sync_api import BrowserContext, ConsoleMessage, Error, Page, Playwright, WebError, Worker

from . import PATIENCE
from .namespace import enclose, installed

# What Playwright switches off so that hidden pages go on as if they were seen.
UNTHROTTLED = (
    "--disable-background-timer-throttling",
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
)

# What Chromium does without. Two renderers for each window, of what the address bar shows below it, and one more for
# a page that might be opened, take half of its time in tests. The others are of those that Playwright switches off,
# because of two lists Chromium takes the last one.
UNUSED = (
    "WebUIOmniboxPopup",
    "WebUIOmniboxAimPopup",
    "SpareRendererForSitePerProcess",
    "AvoidUnnecessaryBeforeUnloadCheckSync",
    "DestroyProfileOnBrowserClose",
    "DialMediaRouteProvider",
    "GlobalMediaControls",
    "HttpsUpgrades",
    "MediaRouter",
    "OptimizationHints",
    "PaintHolding",
    "ThirdPartyStoragePartitioning",
    "Translate",
)

# How many frames a second a page draws: here processors draw them, which have other things to do. Firefox has a
# preference for that; in Chromium each call waits for a part of the time, so that a hidden page still draws none.
FRAMES = 20
FEWER_FRAMES = f"""(() => {{
    const frame = requestAnimationFrame;
    const wanted = new Set();
    let calls = 0;
    globalThis.requestAnimationFrame = (draw) => {{
        const call = (calls += 1);
        wanted.add(call);
        setTimeout(() => frame((now) => wanted.delete(call) && draw(now)), {1000 // FRAMES - 1000 // 60});
        return call;
    }};
    globalThis.cancelAnimationFrame = (call) => wanted.delete(call);
}})()"""

LOG_UNCAUGHT = """() => {
    addEventListener("error", event => console.error("uncaught", event.message));
    addEventListener("unhandledrejection", event => console.error("uncaught", String(event.reason)));
}"""


@dataclass(frozen=True)
class Message:
    """What a page, a worker or a service worker has said: with console.log the kind is "log", and with an error that
    nobody has caught "uncaught"; the kind of a page that has crashed is "crash"."""

    kind: str
    text: str
    place: str = ""

    def __str__(self) -> str:
        return f"{self.kind}: {self.text}" + (f" ({self.place})" if self.place else "")


class Browser:
    """A running browser. Whatever its pages say is a failure of the test, unless the test allows it.

    `context` is a fresh profile; its pages are tabs of one window. Further ones are made by `new_context`. All are
    gone when the test is over, while the process may go on for the next one.

    Not told are what service workers say in Firefox, scripts of workers that Chromium cannot load or Firefox cannot
    read, and errors of a service worker before Playwright knows it: a page that depends on those listens for `error`.
    """

    def __init__(self, name: str, driven: Driven):
        self.name = name
        self.driven = driven
        self.version = driven.version
        self.messages: list[Message] = []
        self.checked = False
        self._allowed: list[re.Pattern[str]] = []
        self.context = self.new_context()

    def new_context(self, **options: Any) -> BrowserContext:
        """A further fresh profile, with options of Playwright."""
        context = self.driven.new_context(**options)
        context.set_default_timeout(1000 * PATIENCE)
        if self.name == "chromium":
            context.add_init_script(FEWER_FRAMES)
        context.on("console", self._hear_console)
        context.on("weberror", self._hear_error)
        context.on("page", self._watch_page)
        context.on("serviceworker", self._watch_service_worker)
        return context

    def open(self, url: str) -> Page:
        """Opens a page in a new tab."""
        page = self.context.new_page()
        page.goto(url)
        return page

    def allow(self, pattern: str) -> None:
        """A message in which this regular expression is found, as it is shown, such as "error: .*", is no failure."""
        self._allowed.append(re.compile(pattern))

    def unexpected(self) -> list[Message]:
        """What has been said so far and is not allowed."""
        self._catch_up()
        return [message for message in self.messages if not any(one.search(str(message)) for one in self._allowed)]

    def check(self) -> None:
        """Fails if something has been said that is not allowed."""
        self.checked = True
        if unexpected := self.unexpected():
            raise AssertionError(f"{self.name} has said:\n" + "\n".join(map(str, unexpected)))

    def _catch_up(self) -> None:
        """Lets in what is on its way: each page answers a question after what it has said before."""
        for context in self.driven.contexts:
            for page in context.pages:
                # A page that has crashed, or is just going to another place, does not answer.
                with suppress(Error):
                    page.evaluate("0")

    def _hear_console(self, message: ConsoleMessage) -> None:
        where = message.location
        self.messages.append(Message(message.type, message.text, f"{where['url']}:{where['lineNumber'] + 1}"))

    def _hear_error(self, error: WebError) -> None:
        self.messages.append(Message("uncaught", str(error.error)))

    def _watch_page(self, page: Page) -> None:
        page.on("crash", lambda page: self.messages.append(Message("crash", page.url)))

    def _watch_service_worker(self, worker: Worker) -> None:
        """Playwright tells what a service worker logs, but not what it does not catch, so that is logged."""
        with suppress(Error):
            worker.evaluate(LOG_UNCAUGHT)


def until(page: Page | Worker, condition: str) -> None:
    """Waits until a condition of JavaScript holds in a page or worker.

    Playwright's own `wait_for_function` has the page make JavaScript of a text when the condition does not hold at
    once, which the policy of the studio's page forbids."""
    end = time.monotonic() + PATIENCE
    while not page.evaluate(condition):
        assert time.monotonic() < end, condition
        time.sleep(0.02)


@contextmanager
def running_chromium(
    playwright: Playwright,
    folder: Path,
    library: Path,
    ports: Path,
    origins: Sequence[str] = (),
    arguments: Sequence[str] = (),
    throttled: bool = False,
    environment: Mapping[str, str] | None = None,
    program: Literal["chromium", "chromium-headless-shell"] = "chromium",
) -> Iterator[Driven]:
    """A process of Chromium whose serial ports are the entries of the folder `ports`.

    Pages of `origins` get them by getPorts() without a question, by a policy which only this Chromium sees. `folder` is
    one of the test; `library` is the stand-in for libudev, and `environment` may have the variables that tell it what
    the ports are. `throttled`: hidden pages go slowly, as those of users do. `program`: the shell is the same Chromium
    without the window around a page, and without serial ports, for two thirds of the work.
    """
    own = _own(folder, "chromium")
    policies = own / "etc" / "policies" / "managed"
    policies.mkdir(parents=True)
    (policies / "test.json").write_text(json.dumps({"SerialAllowAllPortsForUrls": list(origins)}))
    script = enclose(own, installed(program), library, ports, {own / "etc": Path("/etc/chromium")})
    driven = playwright.chromium.launch(
        executable_path=script,
        # Without a graphics card, drawing as if there were one takes longer.
        args=[f"--disable-features={','.join(UNUSED)}", "--disable-gpu", *arguments],
        ignore_default_args=list(UNTHROTTLED) if throttled else None,
        env=_environment(environment),
        # Ctrl-C is for the tests, which end the browser.
        handle_sigint=False,
        timeout=1000 * PATIENCE,
    )
    with closing(driven):
        yield driven


@contextmanager
def running_firefox(
    playwright: Playwright,
    folder: Path,
    library: Path,
    ports: Path,
    chooser: Literal["allow", "block"] = "allow",
    preferences: Mapping[str, str | float | bool] | None = None,
    environment: Mapping[str, str] | None = None,
) -> Iterator[Driven]:
    """A process of Firefox ESR whose serial ports are the entries of the folder `ports`.

    No policy of it allows ports, so a page has to ask by requestPort() when it is clicked. The answer is `chooser`: to
    allow the first port, or to block. `folder`, `library` and `environment` are those of `running_chromium`.
    """
    own = _own(folder, "firefox")
    program = installed("firefox-esr").resolve()
    layer = own / "program"
    (layer / "defaults" / "pref").mkdir(parents=True)
    (layer / "chooser.cfg").write_text((Path(__file__).parent / "chooser.cfg").read_text())
    # Files of an administrator, which Firefox looks for beside its program. They have its full rights if these say so.
    configuration = {
        "general.config.filename": "chooser.cfg",
        "general.config.obscure_value": 0,
        "general.config.sandbox_enabled": False,
    }
    lines = [f"pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in configuration.items()]
    (layer / "defaults" / "pref" / "chooser.js").write_text("".join(lines))
    driven = playwright.firefox.launch(
        # Firefox as it is, by WebDriver BiDi, and not the one that Playwright has changed.
        channel="moz-firefox",
        executable_path=enclose(own, program, library, ports, {layer: program.parent}),
        firefox_user_prefs={"stand_in.chooser": chooser, "layout.frame_rate": FRAMES, **(preferences or {})},
        env=_environment(environment),
        # Ctrl-C is for the tests, which end the browser.
        handle_sigint=False,
        timeout=1000 * PATIENCE,
    )
    with closing(driven):
        yield driven


@contextmanager
def tested(name: str, driven: Driven) -> Iterator[Browser]:
    """A running browser, until the test is over; then it is checked, if that has not been done, and its profiles go."""
    try:
        browser = Browser(name, driven)
        yield browser
        if not browser.checked:
            browser.check()
    finally:
        for context in driven.contexts:
            context.close()


@contextmanager
def chromium(*of: Any, **more: Any) -> Iterator[Browser]:
    """A Chromium of one test alone; it takes what `running_chromium` takes."""
    with running_chromium(*of, **more) as driven, tested("chromium", driven) as browser:
        yield browser


@contextmanager
def firefox(*of: Any, **more: Any) -> Iterator[Browser]:
    """A Firefox of one test alone; it takes what `running_firefox` takes."""
    with running_firefox(*of, **more) as driven, tested("firefox", driven) as browser:
        yield browser


def _own(folder: Path, name: str) -> Path:
    """A folder for one browser; a test may have several of a kind, one after the other."""
    number = len(list(folder.glob(f"{name}*")))
    own = folder / f"{name}{number}"
    own.mkdir(parents=True)
    return own


def _environment(added: Mapping[str, str] | None) -> dict[str, str | float | bool]:
    return {**os.environ, **(added or {})}
