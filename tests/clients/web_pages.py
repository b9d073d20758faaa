#!/usr/bin/env python3
"""Web pages and clients of HTTP at the TCP ports of a virtual module, none of which may reach it.

    python3 tests/clients/web_pages.py target/debug/tmcl

curl, and a page in Chromium, which have to be installed, send all that they can to the ports of --tcp, --slcan-tcp and
--control: requests with bodies of telegrams, frames and lines that turn the motor and press a switch, which begin in each of
the nine phases of a telegram; TLS; web sockets; methods that the page has made up. The motor must not move, no switch be
pressed, and nobody be answered. What the browser says first is recorded at a port of this program as well, so that it is known
that the page has done its work, and that a browser says nothing else.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import base64
import http.server
import json
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from virtual_module import PATIENCE, Simulator, check, command_line, conclude, equal

PORTS = ("tcp", "slcan-tcp", "control")
PHASES = range(9)
METHODS = (
    "GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "PROPFIND", "MKCOL", "QUERY", "SEARCH", "M-SEARCH", "post",
)
# The options of curl for what is no plain request.
OTHERS = {
    "HTTP/2": ("--http2-prior-knowledge", "http://{port}/"),
    "TLS 1.2": ("--tls-max", "1.2", "https://{port}/"),
    "TLS 1.3": ("--tlsv1.3", "https://{port}/"),
    "a proxy": ("--proxy", "http://{port}/", "https://module.invalid/"),
    "a web socket": ("-H", "Connection: Upgrade", "-H", "Upgrade: websocket", "http://{port}/"),
}
NAMES_OF_CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
QUIETLY = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
# What a connection of a browser begins with, of which PAGE does all.
EXPECTED = {b"GET ", b"HEAD ", b"POST ", b"OPTIONS ", b"\x16\x03"}

# Waits for each request, whatever becomes of it.
PAGE = """<!doctype html><title>A page</title><script>
const told = TOLD, tried = url => new Promise(resolve => {
    const image = new Image();
    image.onload = image.onerror = resolve;
    image.src = url;
});
const socket = url => new Promise(resolve => {
    const socket = new WebSocket(url);
    socket.onclose = socket.onerror = resolve;
});
const form = (url, type, text) => new Promise(resolve => {
    const frame = document.createElement("iframe"), form = document.createElement("form");
    const area = document.createElement("textarea");
    frame.name = "to" + Math.random();
    frame.onload = resolve;
    Object.assign(form, { action: url, method: "POST", enctype: type, target: frame.name });
    Object.assign(area, { name: "x", value: text });
    form.append(area);
    document.body.append(frame, form);
    form.submit();
    setTimeout(resolve, 1000);
});
async function all(port) {
    const url = "http://" + port + "/", body = Uint8Array.from(atob(told.body), c => c.charCodeAt(0));
    for (const phase of Array(9).keys()) {
        const padded = new Uint8Array([...Array(phase).fill(32), ...body]);
        await fetch(url, { method: "POST", mode: "no-cors", body: padded }).catch(() => {});
        navigator.sendBeacon(url, padded);
    }
    for (const method of ["GET", "HEAD", "PUT", "DELETE", "PATCH", "PROPFIND", "MVP", "C", "AROR 0,500"])
        for (const mode of ["no-cors", "cors"])
            await Promise.resolve().then(() => fetch(url, { method, mode, body: undefined })).catch(() => {});
    for (const secure of ["https://", "wss://"])
        await (secure === "wss://" ? socket(secure + port) : fetch(secure + port, { mode: "no-cors" }).catch(() => {}));
    await socket("ws://" + port);
    await tried(url + "x.png");
    for (const type of ["text/plain", "multipart/form-data", "application/x-www-form-urlencoded"])
        await form(url, type, told.lines);
}
onload = async () => {
    await Promise.all(told.ports.map(all));
    await fetch("/done", { method: "POST" });
};
</script><body></body>"""


def telegram(address, opcode, kind, motor, value):
    head = bytes([address, opcode, kind, motor]) + value.to_bytes(4, "big")
    return head + bytes([sum(head) & 0xFF])


TURN = telegram(1, 1, 0, 0, 500)
LINES = f"\rS8\rO\rt0017{TURN[1:8].hex().upper()}\r\npress left\nsend ROR 0, 500\n"
BODY = TURN * 50 + LINES.encode()


class Recorder:
    """A port that answers nobody and keeps what each connection begins with."""

    def __init__(self):
        self.heard = []
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:{}".format(self.listener.getsockname()[1])
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        while True:
            connection, _ = self.listener.accept()
            threading.Thread(target=self.hear, args=(connection,), daemon=True).start()

    def hear(self, connection):
        with connection:
            try:
                self.heard.append(connection.recv(64))
            except OSError:
                pass


class Pages(http.server.ThreadingHTTPServer):
    """A web server with the page; `done` is set when the page has done all."""

    def __init__(self, page):
        self.page, self.done = page.encode(), threading.Event()
        super().__init__(("127.0.0.1", 0), Request)
        threading.Thread(target=self.serve_forever, daemon=True).start()


class Request(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(self.server.page)))
        self.end_headers()
        self.wfile.write(self.server.page)

    def do_POST(self):
        self.send_response(204)
        self.end_headers()
        self.server.done.set()

    def log_message(self, *_):
        pass


def found(*names):
    """The path of the first of these programs that is installed."""
    paths = [path for path in map(shutil.which, names) if path]
    return paths[0] if paths else sys.exit(f"{names[0]} is not installed")


def nothing_has_happened(simulator, whom):
    """Asks the module itself: its motor has no speed to go to, and stands where it stood."""
    for parameter, name in ((1, "position"), (2, "target speed"), (3, "speed")):
        with simulator.connect("tcp") as host:
            host.sendall(telegram(1, 6, parameter, 0, 0))
            reply = host.makefile("rb").read(9)
        equal(f"{name} after {whom}", int.from_bytes(reply[4:8], "big", signed=True), 0)
    state = simulator.control("state")
    equal(f"switch after {whom}", state["switches"]["left"], False)
    equal(f"rotor after {whom}", state["rotor"], 0)


def with_curl(simulator):
    curl = [found("curl"), "--silent", "--show-error", "--insecure", "--max-time", str(PATIENCE), "--noproxy", ""]
    with tempfile.TemporaryDirectory() as folder:
        for name in PORTS:
            port = simulator.told[name]
            bodies = []
            for phase in PHASES:
                bodies.append(Path(folder) / f"body{phase}")
                bodies[phase].write_bytes(b" " * phase + BODY)
            tries = {f"{method} with a body": ("-X", method, "--data-binary", f"@{bodies[0]}", f"http://{port}/")
                     for method in METHODS}
            tries |= {f"POST in phase {phase}": ("--data-binary", f"@{bodies[phase]}", f"http://{port}/")
                      for phase in PHASES}
            tries |= {what: tuple(option.format(port=port) for option in options) for what, options in OTHERS.items()}
            for what, options in tries.items():
                done = subprocess.run([*curl, *options], capture_output=True, timeout=2 * PATIENCE)
                # An end too early or without a reply, an error of TLS, a failure of sending or receiving, by the numbers of curl.
                told = (done.returncode, done.stdout, done.stderr)
                check(f"curl: {what} at --{name}", done.returncode in (16, 18, 35, 52, 55, 56) and not done.stdout, told)
            nothing_has_happened(simulator, f"curl at --{name}")


def with_chromium(simulator):
    chromium, recorder = found(*NAMES_OF_CHROMIUM), Recorder()
    told = {"ports": [recorder.address, *(simulator.told[name] for name in PORTS)], "lines": BODY[-len(LINES):].decode()}
    told["body"] = base64.b64encode(BODY).decode()
    pages = Pages(PAGE.replace("TOLD", json.dumps(told)))
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        url = f"http://127.0.0.1:{pages.server_address[1]}/"
        arguments = [chromium, *QUIETLY, f"--user-data-dir={folder}", "--remote-debugging-port=0", url]
        with open(Path(folder) / "said", "w+") as said:
            browser = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, stdout=said, stderr=said)
            try:
                done = pages.done.wait(PATIENCE)
                said.seek(0)
                check("the page has done its work", done, "" if done else said.read()[-2000:])
            finally:
                browser.terminate()
                browser.wait()
    nothing_has_happened(simulator, "Chromium")
    # Chromium opens some connections without a word.
    firsts = [first for first in recorder.heard if first]
    for expected in EXPECTED:
        check(f"Chromium has begun with {expected}", any(first.startswith(expected) for first in firsts), firsts)
    strange = [first for first in firsts if not first.startswith(tuple(EXPECTED))]
    check("Chromium begins with nothing else", not strange, strange)


def main():
    options = command_line(__doc__)
    simulator = Simulator(options.binary, "--tcp", "127.0.0.1:0", "--slcan-tcp", "127.0.0.1:0")
    try:
        with_curl(simulator)
        with_chromium(simulator)
    finally:
        simulator.end()
    conclude()


if __name__ == "__main__":
    main()
