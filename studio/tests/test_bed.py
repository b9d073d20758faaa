"""Tests of the test bed itself, with pages of their own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from bed import PATIENCE
from bed import browser as browsers
from bed.browser import Browser
from bed.module import VirtualModule
from bed.server import Elsewhere, Site
from playwright.sync_api import Page, Playwright

# GAP 1, 0: the actual position of axis 0; and the reply of a module that has just been started.
REQUEST = bytes.fromhex("01 06 01 00 00 00 00 00 08")
REPLY = bytes.fromhex("02 01 64 06 00 00 00 00 6D")
EXCHANGED = (f">  {REQUEST.hex(' ').upper()}", f"<  {REPLY.hex(' ').upper()}")

# A page needs an icon, or Chromium asks for /favicon.ico and complains that there is none.
HEAD = '<!doctype html><meta charset="utf-8"><title>A page</title><link rel="icon" href="data:,">'

# Functions for page and worker: `call` has the worker call one of its functions.
PAGE = """
<button onclick="navigator.serial.requestPort().then(() => tell('allowed'), error => tell(error.name))">Choose</button>
<script>
let answer;
const tell = told => answer = told;
const events = [];
for (const type of ["connect", "disconnect"])
    navigator.serial.addEventListener(type, () => events.push(type));
const worker = new Worker("worker.js");
const call = (name, ...values) => new Promise((resolve, reject) => {
    worker.onmessage = ({ data }) => resolve(data);
    worker.onerror = ({ message }) => reject(new Error(message));
    worker.postMessage([name, values]);
});
</script>
"""
WORKER = """
const functions = {
    // The number of ports, and what comes from the first one in answer to a request.
    async exchange(request) {
        const ports = await navigator.serial.getPorts(), [port] = ports;
        await port.open({ baudRate: 9600 });
        const writer = port.writable.getWriter(), reader = port.readable.getReader(), got = [];
        await writer.write(new Uint8Array(request));
        while (got.length < 9)
            got.push(...(await reader.read()).value);
        writer.releaseLock();
        reader.releaseLock();
        await port.close();
        return [ports.length, got];
    },
    // What a module of WebAssembly gives whose function g calls the function f, of the page, which waits.
    async suspended() {
        const f = async () => {
            await new Promise(resolve => setTimeout(resolve));
            return 42;
        };
        const bytes = new Uint8Array([
            0, 0x61, 0x73, 0x6d, 1, 0, 0, 0,
            1, 5, 1, 0x60, 0, 1, 0x7f, // a type: no parameters, an integer as the result
            2, 7, 1, 1, 0x6d, 1, 0x66, 0, 0, // import "m" "f"
            3, 2, 1, 0, 7, 5, 1, 1, 0x67, 0, 1, // export "g"
            10, 6, 1, 4, 0, 0x10, 0, 0x0b, // call f
        ]);
        const { instance } = await WebAssembly.instantiate(bytes, { m: { f: new WebAssembly.Suspending(f) } });
        return WebAssembly.promising(instance.exports.g)();
    },
    fetched: url => fetch(url).then(() => true, () => false),
};
onmessage = async ({ data: [name, values] }) => postMessage(await functions[name](...values));
"""


def opened(browser: Browser, site: Site, head: str = HEAD) -> Page:
    """The page, opened; it may use the first serial port, if there is one."""
    site.write(index__html=head + PAGE, worker__js=WORKER)
    page = browser.open(site.url)
    if browser.name == "firefox":
        page.get_by_role("button").click()
        page.wait_for_function("answer === 'allowed'")
    return page


def wait_until(what: str, condition: Callable[[], object]) -> None:
    """Waits until the condition holds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.02)


def processes(folder: Path) -> list[str]:
    """The processes that have to do with a folder, by their arguments and their environment."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes()
            known = os.fsencode(folder) in words + (process / "environ").read_bytes()
        except OSError:
            continue
        if known and process.name != str(os.getpid()):
            found.append(f"{process.name}: {words!r}")
    return found


# Web Serial.


def test_worker_reads_and_writes(browser: Browser, site: Site, module: VirtualModule) -> None:
    page = opened(browser, site)
    assert page.evaluate("request => call('exchange', request)", list(REQUEST)) == [1, list(REPLY)]
    module.wait_for_telegrams(*EXCHANGED)
    assert module.ask("state")["position"] == 0


def test_port_is_a_usb_port_with_lines_of_a_modem(browser: Browser, site: Site, module: VirtualModule) -> None:
    page = opened(browser, site)
    told = page.evaluate(
        """async () => {
            const [port] = await navigator.serial.getPorts();
            await port.open({ baudRate: 9600 });
            await port.setSignals({ dataTerminalReady: true });
            const { clearToSend } = await port.getSignals();
            await port.close();
            return [port.getInfo(), clearToSend];
        }"""
    )
    assert told == [{"usbVendorId": 0x2A3C, "usbProductId": 0x0100}, False]


def test_cable_is_pulled_out_and_plugged_in(browser: Browser, site: Site, module: VirtualModule) -> None:
    page = opened(browser, site)
    count = "navigator.serial.getPorts().then(ports => ports.length)"
    assert page.evaluate(count) == 1
    module.ask("usb off --hangup")
    page.wait_for_function("events.at(-1) === 'disconnect'")
    assert page.evaluate(count) == 0
    module.ask("usb on")
    page.wait_for_function("events.at(-1) === 'connect'")
    assert page.evaluate("request => call('exchange', request)", list(REQUEST)) == [1, list(REPLY)]


def test_several_ports(chromium: Browser, site: Site, module: VirtualModule, ports: Path, tmp_path: Path) -> None:
    with VirtualModule(ports / "ttyACM1", tmp_path, "--product", "6110"):
        page = opened(chromium, site)
        page.wait_for_function("navigator.serial.getPorts().then(ports => ports.length === 2)")


def test_chromium_allows_ports_to_one_origin(chromium: Browser, module: VirtualModule, tmp_path: Path) -> None:
    folder = tmp_path / "other"
    folder.mkdir()
    with Site(folder) as other:
        other.write(index__html=HEAD)
        page = chromium.open(other.url)
        assert page.evaluate("navigator.serial.getPorts().then(ports => ports.length)") == 0


def test_firefox_refuses(
    playwright: Playwright, site: Site, module: VirtualModule, ports: Path, library: Path, tmp_path: Path
) -> None:
    site.write(index__html=HEAD + PAGE, worker__js=WORKER)
    with browsers.firefox(playwright, tmp_path, library, ports, chooser="block") as firefox:
        page = firefox.open(site.url)
        page.get_by_role("button").click()
        page.wait_for_function("answer === 'NotFoundError'")


# WebAssembly.


def test_worker_suspends_webassembly(browser: Browser, site: Site, module: VirtualModule) -> None:
    assert opened(browser, site).evaluate("call('suspended')") == 42


# Servers.


def test_site_sends_no_special_header(chromium: Browser, site: Site) -> None:
    site.write(index__html=HEAD, a__wasm="", a__js="", a__css="")
    page = chromium.open(site.url)
    types = {}
    for name in ("index.html", "a.wasm", "a.js", "a.css"):
        headers = page.evaluate("async name => Object.fromEntries((await fetch(name)).headers)", name)
        types[name] = headers["content-type"]
        assert set(headers) == {"server", "date", "content-type", "content-length", "last-modified"}
    assert types == {
        "index.html": "text/html; charset=utf-8",
        "a.wasm": "application/wasm",
        "a.js": "text/javascript",
        "a.css": "text/css",
    }
    assert [request.path for request in site.requests] == ["/", "/index.html", "/a.wasm", "/a.js", "/a.css"]


def test_elsewhere_tells_who_reaches_it(chromium: Browser, site: Site, elsewhere: Elsewhere) -> None:
    policy = "<meta http-equiv='Content-Security-Policy' content=\"connect-src 'self'\">"
    fetched = "url => fetch(url, { method: 'PUT', body: 'x' }).then(() => true, () => false)"
    page = opened(chromium, site, HEAD + policy)
    assert page.evaluate(fetched, elsewhere.url) is False
    assert elsewhere.requests == []
    chromium.allow("Content Security Policy")
    # A policy of the page alone is none of its workers.
    assert page.evaluate("url => call('fetched', url)", elsewhere.url + "worker") is True
    page = opened(chromium, site)
    assert page.evaluate(fetched, elsewhere.url + "page") is True
    told = [(request.method, request.path, request.body) for request in elsewhere.requests]
    assert told == [("GET", "/worker", b""), ("OPTIONS", "/page", b""), ("PUT", "/page", b"x")]


# What is said.

# Each with what the browsers have to say about it.
SAYS = {
    "console.log('page')": "log: page",
    "console.error('page')": "error: page",
    "setTimeout(() => { throw new Error('thrown'); })": "uncaught: thrown",
    "Promise.reject(new Error('rejected'))": "uncaught: rejected",
    "new Worker('says.js')": "warning: worker",
    "new Worker('throws.js')": "uncaught: thrown in worker",
    "new Worker('rejects.js')": "uncaught: rejected in worker",
}


@pytest.mark.parametrize("script", SAYS)
def test_what_is_said_fails_a_test(plain: Browser, site: Site, script: str) -> None:
    site.write(
        index__html=HEAD,
        says__js="console.warn('worker');",
        throws__js="throw new Error('thrown in worker');",
        rejects__js="Promise.reject(new Error('rejected in worker'));",
    )
    page = plain.open(site.url)
    plain.check()
    page.evaluate(f"() => {{ {script}; }}")
    wait_until(SAYS[script], plain.unexpected)
    with pytest.raises(AssertionError, match=SAYS[script]):
        plain.check()
    plain.allow(SAYS[script])
    plain.check()


def test_service_worker_is_heard(chromium: Browser, site: Site) -> None:
    throws = "onmessage = () => { throw new Error('thrown'); };"
    site.write(index__html=HEAD, service__js=f"console.log('service'); {throws}")
    page = chromium.open(site.url)
    page.evaluate("navigator.serviceWorker.register('service.js')")
    chromium.allow("log: service")
    wait_until("the log", lambda: chromium.messages)
    assert chromium.unexpected() == []
    page.evaluate("navigator.serviceWorker.ready.then(({ active }) => active.postMessage(0))")
    wait_until("the error", chromium.unexpected)
    chromium.allow("error: uncaught .*thrown")


def test_fixtures_fail_what_says_something(tmp_path: Path) -> None:
    test = "def test(chromium, site):\n    chromium.open(site.url).evaluate(\"console.error('oh')\")\n"
    path = tmp_path / "test_says.py"
    path.write_text(test)
    here = Path(__file__).parent
    words = [sys.executable, "-m", "pytest", "-q", "-p", "conftest", "-c", str(here / "pytest.ini")]
    done = subprocess.run(
        [*words, f"--rootdir={tmp_path}", f"--basetemp={tmp_path / 'inner'}", str(path)],
        env={**os.environ, "PYTHONPATH": str(here)},
        capture_output=True,
        text=True,
    )
    assert "1 failed" in done.stdout
    assert "error: oh" in done.stdout


# What is left.


def test_nothing_is_left(
    playwright: Playwright, site: Site, module: VirtualModule, ports: Path, library: Path, tmp_path: Path
) -> None:
    def policies() -> list[Path]:
        return sorted(Path("/etc/chromium").rglob("*"))

    before, mounts = policies(), Path("/proc/self/mounts").read_text()
    with (
        browsers.chromium(playwright, tmp_path, library, ports, [site.origin]) as chromium,
        browsers.firefox(playwright, tmp_path, library, ports) as firefox,
    ):
        for browser in (chromium, firefox):
            opened(browser, site)
        assert len(processes(tmp_path)) > 2
        assert policies() == before
        assert Path("/proc/self/mounts").read_text() == mounts
    module.close()
    wait_until("the end of all processes", lambda: not processes(tmp_path))
    assert list(ports.iterdir()) == []


ENDLESS = """
import sys, threading
from pathlib import Path
from bed.browser import chromium, firefox
from bed.module import VirtualModule
from playwright.sync_api import sync_playwright

folder, library = map(Path, sys.argv[1:])
ports = folder / "ports"
with (
    sync_playwright() as playwright,
    VirtualModule(ports / "ttyACM0", folder),
    chromium(playwright, folder, library, ports),
    firefox(playwright, folder, library, ports),
):
    print("ready", flush=True)
    threading.Event().wait()
"""


def test_killed(library: Path, ports: Path, tmp_path: Path) -> None:
    """All ends with what is killed, here a script in the background, which does not hear Ctrl-C.

    The name is short, because it is part of the path of a socket of Chromium, which has 107 characters at most.
    """
    process = subprocess.Popen(
        ["/bin/sh", "-c", 'trap "" INT && exec "$@"', "sh", sys.executable, "-c", ENDLESS, tmp_path, library],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent), "TMPDIR": str(tmp_path)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        assert process.stdout
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
        assert len(processes(tmp_path)) > 3
        assert process.poll() is None
    finally:
        process.kill()
        process.wait()
    process.stdout.close()
    wait_until("the end of all processes", lambda: not processes(tmp_path))
