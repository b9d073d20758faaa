"""Web servers of a test: one for the page, and one that stands for everybody else."""

from __future__ import annotations

import http.server
import threading
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus
from pathlib import Path
from types import TracebackType
from typing import TypeVar

S = TypeVar("S", bound="Server")


@dataclass(frozen=True)
class Request:
    """A request that a server has got."""

    method: str
    path: str
    headers: dict[str, str]
    body: bytes


class Server:
    """A web server at a free port of this computer, with all requests so far in `requests`. It ends with the `with`
    block."""

    def __init__(self, handler: type[_Static] | partial[_Static] | type[_Welcoming]):
        self.requests: list[Request] = []
        self._server = _Listener(("127.0.0.1", 0), handler)
        self._server.requests = self.requests
        self.origin = f"http://127.0.0.1:{self._server.server_port}"
        self.url = self.origin + "/"
        threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()

    def __enter__(self: S) -> S:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._server.shutdown()
        self._server.server_close()


class Site(Server):
    """A plain static web server, as those that many have: files of a folder, with their types and times, and no header
    that protects a page."""

    def __init__(self, folder: Path):
        self.folder = folder
        super().__init__(partial(_Static, directory=str(folder)))

    def write(self, **files: str) -> None:
        """Writes files; in their names __ stands for the dot."""
        for name, text in files.items():
            (self.folder / name.replace("__", ".")).write_text(text)


class Elsewhere(Server):
    """Another origin, which welcomes every request: if a page reaches it, `requests` has it, and only the page's own
    policy can keep it from that."""

    def __init__(self) -> None:
        super().__init__(_Welcoming)


class _Listener(http.server.ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    requests: list[Request]


class _Handler(http.server.BaseHTTPRequestHandler):
    server: _Listener

    def record(self) -> None:
        """Keeps the request, with its body."""
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        self.server.requests.append(Request(self.command, self.path, dict(self.headers.items()), body))

    def log_message(self, format: str, *values: object) -> None:  # noqa: A002
        """Says nothing."""


class _Static(_Handler, http.server.SimpleHTTPRequestHandler):
    extensions_map = {  # noqa: RUF012
        "": "application/octet-stream",
        ".css": "text/css",
        ".html": "text/html; charset=utf-8",
        ".js": "text/javascript",
        ".json": "application/json",
        ".mjs": "text/javascript",
        ".png": "image/png",
        ".svg": "image/svg+xml",
        ".txt": "text/plain; charset=utf-8",
        ".wasm": "application/wasm",
        ".webmanifest": "application/manifest+json",
    }

    def do_GET(self) -> None:
        self.record()
        # Times are seconds, and a test may write a file twice in one: it is always sent.
        del self.headers["If-Modified-Since"]
        super().do_GET()

    def do_HEAD(self) -> None:
        self.record()
        super().do_HEAD()


class _Welcoming(_Handler):
    def welcome(self) -> None:
        self.record()
        self.send_response(HTTPStatus.OK)
        for name in ("Origin", "Methods", "Headers"):
            self.send_header(f"Access-Control-Allow-{name}", "*")
        self.send_header("Content-Length", "0")
        self.end_headers()

    do_DELETE = do_GET = do_HEAD = do_OPTIONS = do_PATCH = do_POST = do_PUT = welcome
