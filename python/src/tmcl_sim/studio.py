"""Serves the studio, a page for virtual and real modules, to the browsers of this computer:

    python -m tmcl_sim.studio --open

The page comes with the package, in its folder `page`. A browser gets the same answers as from `cargo studio`, which
serves the page of a checkout (studio/build/src/ of the repository). Python's http.server would give others: it takes
`//index.html` for `/index.html`, and repeats in its errors what was asked for."""

from __future__ import annotations

import argparse
import os
import re
import signal
import socket
import sys
import threading
import time
import webbrowser
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

HELP = """\
Shows the studio in a web browser: a page on which programs for Trinamic's stepper motor modules (TMCM-1140 and others)
are written, tried and debugged, and their motors watched. The modules are virtual ones in the page, so no hardware is
needed, or real ones at a serial port (Chrome, Edge, Firefox)."""
END_OF_HELP = """\
The address of the page is printed, and `ready` when it can be opened. Only browsers of this computer reach it. Ctrl-C
ends the program."""
PAGE = Path(__file__).parent / "page"
# The kinds of files that a page has: how the name ends, and what a browser is told.
KINDS = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
    "wasm": "application/wasm",
    "txt": "text/plain; charset=utf-8",
}
# Headers that every answer has, beside those that tell its body and the policy.
HEADERS = """\
X-Content-Type-Options: nosniff\r
Cache-Control: no-cache\r
Referrer-Policy: no-referrer\r
Cross-Origin-Resource-Policy: same-origin\r
Connection: close\r
"""
# How many connections are served at once. More of them wait for these to end.
CONNECTIONS = 64
# The longest request, in bytes, with the empty line that ends it.
LIMIT, END = 16 * 1024, b"\r\n\r\n"
# How many seconds a request may take to come, and a piece of the answer to be fetched.
PATIENCE = 10.0
# What is read of what follows a request, in bytes and for how many seconds.
REST = (1 << 20, 2.0)
# Where the page tells its policy, which has no letter that HTML writes in another way.
POLICY = re.compile(rb'<meta http-equiv="Content-Security-Policy" content="([ !#-%\'-;=?-~]+)">')
# What the protocol has as names of methods and headers, and as letters of addresses and of headers.
WORD, LETTER, TEXT = r"[A-Za-z0-9!#$%&'*+.^_`|~-]+", r"[^\x00-\x20\x7f-\x9f]", r"[^\x00-\x08\x0a-\x1f\x7f-\x9f]"
REQUEST = re.compile(rf"({WORD}) (/{LETTER}*) HTTP/1\.[01]\r\n((?:{WORD}:{TEXT}*\r\n)*)\r\n")
HOST = re.compile(r"^host:(.*)\r$", re.IGNORECASE | re.MULTILINE)

# The files of a page by their paths, such as `plot/axis.js`: what a browser is told of each, and what it holds.
Files = dict[str, tuple[str, bytes]]


class Server:
    """A server of a page for the programs of this computer alone, at a port, or at any free one if that is 0."""

    def __init__(self, files: Files, policy: str, port: int):
        self._files, self._policy = files, policy
        self._listener = socket.create_server(("127.0.0.1", port), backlog=128)
        self.port: int = self._listener.getsockname()[1]
        """The port at which it is."""

    def start(self) -> None:
        """Serves in threads, which end with the process."""
        # Where a computer has no more threads, fewer connections are served at once.
        with suppress(RuntimeError):
            for _ in range(1, CONNECTIONS):
                threading.Thread(target=self.serve, daemon=True).start()

    def serve(self) -> NoReturn:
        """Serves one connection after the other."""
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                # As where no more files can be open, which passes.
                time.sleep(0.1)
                continue
            # A connection that fails is the browser's loss, which asks again.
            with connection, suppress(OSError):
                self._converse(connection)

    def _converse(self, connection: socket.socket) -> None:
        request = b""
        for piece in _received(connection, LIMIT + 1, PATIENCE):
            request += piece
            if END in request:
                break
        # Browsers open connections that they may need later.
        if not request:
            return
        answer = memoryview(self._answer(request))
        connection.settimeout(PATIENCE)
        while answer:
            answer = answer[connection.send(answer) :]
        connection.shutdown(socket.SHUT_WR)
        # A connection that is closed before all is read takes the answer with it.
        for _ in _received(connection, *REST):
            pass

    def _answer(self, received: bytes) -> bytes:
        """What bytes get that begin with a request. Nothing in it comes from them."""
        before, end, _ = received.partition(END)
        request = before + end
        # One that is too long is none without its end.
        method, path, host = _parsed(request[:LIMIT])
        kind = KINDS["txt"]
        if len(request) > LIMIT:
            status, body = "431 Request Header Fields Too Large", b"The request is too long.\n"
        elif not method:
            status, body = "400 Bad Request", b"This is no request.\n"
        # A page of others, whose name has become that of this computer, is not to read what is here.
        elif host not in (f"127.0.0.1:{self.port}", f"localhost:{self.port}"):
            status, body = "421 Misdirected Request", b"Ask for the address that tmcl_sim.studio has printed.\n"
        elif method not in ("GET", "HEAD"):
            status, body = "405 Method Not Allowed\r\nAllow: GET, HEAD", b"Files are here to be read only.\n"
        elif file := self._files.get(path):
            status, (kind, body) = "200 OK", file
        else:
            status, body = "404 Not Found", b"The page has no such file.\n"
        head = f"HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n{HEADERS}"
        head += f"Content-Security-Policy: {self._policy}\r\n\r\n"
        return head.encode() + (b"" if method == "HEAD" else body)


def _received(connection: socket.socket, length: int, seconds: float) -> Iterator[bytes]:
    """What comes over a connection, until it ends or fails, or so many bytes or seconds have passed."""
    end = time.monotonic() + seconds
    with suppress(OSError):
        while length and (left := end - time.monotonic()) > 0:
            connection.settimeout(left)
            if not (piece := connection.recv(min(length, 1 << 16))):
                return
            length -= len(piece)
            yield piece


def _parsed(request: bytes) -> tuple[str, str, str]:
    """Method, path of a file, and host of a request; all empty if the protocol has no such request."""
    # What is not UTF-8, as cookies of other programs may be, is in headers that do not matter, or names no file.
    if not (found := REQUEST.fullmatch(request.decode(errors="replace"))):
        return "", "", ""
    method, address, headers = found.groups()
    hosts = [host.strip(" \t") for host in HOST.findall(headers)]
    if len(hosts) > 1:
        return "", "", ""
    return method, address.partition("?")[0][1:] or "index.html", "".join(hosts)


def _files(folder: Path, above: str = "") -> Files:
    """Reads a folder, without what begins with a dot. Raises ValueError if something in it is no file of a page."""
    files: Files = {}
    for entry in folder.iterdir():
        path, ending = above + entry.name, entry.suffix[1:]
        if entry.name.startswith("."):
            continue
        if entry.is_dir():
            files |= _files(entry, f"{path}/")
        # Other letters do not stand for themselves in an address.
        elif ending not in KINDS or not re.fullmatch(r"[A-Za-z0-9_./-]+", path):
            raise ValueError(f"{entry} is no file of a page")
        else:
            files[path] = (KINDS[ending], entry.read_bytes())
    return files


def _policy(files: Files) -> str:
    """What the page may do in a browser, as a header. Raises ValueError if the page does not tell it once."""
    policies = POLICY.findall(files["index.html"][1])
    if len(policies) != 1:
        raise ValueError(f"index.html has {len(policies)} policies")
    # Browsers take it only from a header that no other page frames this one.
    return f"{policies[0].decode()}; frame-ancestors 'none'"


def _port(text: str) -> int:
    if not re.fullmatch("[0-9]{1,5}", text) or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"a number from 0 to 65535 is wanted, not {text!r}")
    return int(text)


def _open(address: str) -> None:
    try:
        is_open = webbrowser.open(address)
    except Exception:  # Whatever is wrong with the browser or its settings, the page is there.
        is_open = False
    if not is_open:
        print("no browser can be started: open the address above yourself", file=sys.stderr)


def main() -> NoReturn:
    """Serves the page until the process ends."""
    parser = argparse.ArgumentParser(
        "python -m tmcl_sim.studio", description=HELP, epilog=END_OF_HELP, allow_abbrev=False
    )
    parser.add_argument("--port", type=_port, default=0, metavar="N", help="serve at this port, not at any free one")
    parser.add_argument("--open", action="store_true", help="open the page in your browser")
    said = parser.parse_args()
    if not (PAGE / "index.html").is_file():
        sys.exit(
            f"this tmcl-sim has come without the page ({PAGE}): in a checkout of the repository `cargo studio` builds "
            "and serves it, and `scripts/wheel` builds packages that have it"
        )
    try:
        files = _files(PAGE)
        policy = _policy(files)
    except (OSError, ValueError) as error:
        sys.exit(f"the page of tmcl-sim is not whole ({error}): install the package anew")
    try:
        server = Server(files, policy, said.port)
    except OSError as error:
        why = os.strerror(error.errno or 0)
        sys.exit(f"nothing can be served at port {said.port}: {why}; choose another by --port")
    address = f"http://127.0.0.1:{server.port}/"
    try:
        # At once and unbuffered: nothing is left of it that would be tried again, and fail again, at the end.
        os.write(1, f"{address}\nready\n".encode())
    except OSError as error:
        sys.exit(f"nothing can be printed: {error.strerror}")
    server.start()
    if said.open:
        _open(address)
    server.serve()


if __name__ == "__main__":
    # Ctrl-C ends the program as it ends others, without a word; in the background it may be meant not to hear it.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    main()
