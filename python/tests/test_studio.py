"""The program that serves the studio: what browsers get of it, what others get, how it begins, and how it ends.

Most tests give it a page of their own, in a copy of the package."""

from __future__ import annotations

import http.client
import os
import re
import select
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

import pytest

import tmcl_sim

# The longest that a busy computer may take, in seconds.
PATIENCE = 60
PACKAGE = Path(tmcl_sim.__file__).parent
POLICY = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; img-src 'self' data:"
META = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
INDEX = f"<!doctype html>\n{META}\n<p>\u00b5\n"
# The end of the head of each answer.
HEADERS = f"""\
X-Content-Type-Options: nosniff\r
Cache-Control: no-cache\r
Referrer-Policy: no-referrer\r
Cross-Origin-Resource-Policy: same-origin\r
Connection: close\r
Content-Security-Policy: {POLICY}; frame-ancestors 'none'\r
\r
"""
# The files of the page: what a browser is told of each, and what it holds.
FILES = {
    "index.html": ("text/html; charset=utf-8", INDEX.encode()),
    "style.css": ("text/css; charset=utf-8", b"p {}"),
    "plot/axis-2_a.js": ("text/javascript; charset=utf-8", b""),
    "mark.svg": ("image/svg+xml", b"<svg/>"),
    "studio.wasm": ("application/wasm", bytes(range(256)) * 20_000),
    "notes.txt": ("text/plain; charset=utf-8", b"text"),
}
# The longest request, in bytes, and how many connections are served at once.
LIMIT, CONNECTIONS = 16 * 1024, 64
# Runs the program with other times than its own: for a request, for what follows it, and for the answer to be fetched.
WITH_PATIENCE = "from tmcl_sim import studio; studio.PATIENCE = {0}; studio.REST = (1 << 20, {0}); studio.main()"


def copy(folder: Path) -> Path:
    """A copy of the package in a folder, without a page; the folder where it would be."""
    shutil.copytree(PACKAGE, folder / "tmcl_sim", ignore=shutil.ignore_patterns("page", "__pycache__"))
    return folder / "tmcl_sim" / "page"


def put(page: Path, files: dict[str, tuple[str, bytes]]) -> None:
    for name, (_, text) in files.items():
        (page / name).parent.mkdir(parents=True, exist_ok=True)
        (page / name).write_bytes(text)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a copy of the package that has a page, and what is not of the page in it and beside it."""
    folder = tmp_path_factory.mktemp("package")
    page = copy(folder)
    put(page, FILES | {".hidden.js": ("", b"secret"), "../secret.js": ("", b"secret")})
    return folder


def start(
    folder: Path | None,
    *arguments: str,
    environment: dict[str, str] | None = None,
    stdout: int = subprocess.PIPE,
    hears: bool = True,
) -> subprocess.Popen[str]:
    """Starts Python with the copy of the package in a folder, or with the package itself. It hears Ctrl-C, or not."""

    def ready() -> None:
        # Whoever runs the tests may ignore the signal.
        signal.signal(signal.SIGINT, signal.default_int_handler if hears else signal.SIG_IGN)

    path = {"PYTHONPATH": str(folder)} if folder else {}
    return subprocess.Popen(
        [sys.executable, *arguments],
        env=os.environ | path | (environment or {}),
        stdin=subprocess.DEVNULL,
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=ready,
    )


def told(file: IO[str] | None, last: str) -> str:
    """What a process writes until a last line comes, or until it ends."""
    assert file
    said = b""
    while not said.endswith(last.encode()):
        assert select.select([file], [], [], PATIENCE)[0], f"it writes no more than {said!r}"
        if not (piece := os.read(file.fileno(), 1000)):
            break
        said += piece
    return said.decode()


def port_of(process: subprocess.Popen[str]) -> int:
    """Where it serves, when it is ready. Raises ConnectionError with its words if it has ended instead."""
    said = told(process.stdout, "\nready\n")
    if not said:
        raise ConnectionError(told(process.stderr, "\n"))
    address = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\nready\n", said)
    assert address, said
    return int(address[1])


@contextmanager
def running(process: subprocess.Popen[str]) -> Iterator[int]:
    """The port of a process that serves. At the end it still does, and has said nothing of whoever has asked."""
    try:
        yield port_of(process)
        assert process.poll() is None
        process.kill()
        assert process.communicate(timeout=PATIENCE) == ("", "")
    finally:
        process.kill()
        process.communicate()


@pytest.fixture(scope="module")
def port(folder: Path) -> Iterator[int]:
    """Where the program serves; a slow browser has an hour, which no test takes, however busy the computer is."""
    with running(start(folder, "-c", WITH_PATIENCE.format(3600))) as port:
        yield port


def connect(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)


def rest(connection: socket.socket) -> tuple[str, bytes]:
    """The head and the body of the answer that comes over a connection."""
    with connection.makefile("rb") as file:
        head, end, body = file.read().partition(b"\r\n\r\n")
    return (head + end).decode(), body


def send(port: int, request: bytes) -> tuple[str, bytes]:
    """The head and the body of what bytes get, after which no more come."""
    with connect(port) as connection:
        connection.sendall(request)
        connection.shutdown(socket.SHUT_WR)
        return rest(connection)


def request(port: int, path: str, method: str = "GET") -> bytes:
    return f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode()


def ask(port: int, path: str, method: str = "GET") -> tuple[str, bytes]:
    return send(port, request(port, path, method))


def expected(status: str, kind: str, body: bytes) -> tuple[str, bytes]:
    return f"HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n{HEADERS}", body


def refusal(status: str, sentence: str) -> tuple[str, bytes]:
    return expected(status, "text/plain; charset=utf-8", sentence.encode())


NOT_FOUND = refusal("404 Not Found", "The page has no such file.\n")
NO_REQUEST = refusal("400 Bad Request", "This is no request.\n")
MISDIRECTED = refusal("421 Misdirected Request", "Ask for the address that tmcl_sim.studio has printed.\n")
READ_ONLY = refusal("405 Method Not Allowed\r\nAllow: GET, HEAD", "Files are here to be read only.\n")
TOO_LONG = refusal("431 Request Header Fields Too Large", "The request is too long.\n")


def test_a_browser_gets_the_files_of_the_page(port: int) -> None:
    for name, (kind, text) in FILES.items():
        head, body = expected("200 OK", kind, text)
        assert ask(port, f"/{name}") == (head, body)
        assert ask(port, f"/{name}?1?2") == (head, body)
        assert ask(port, f"/{name}", "HEAD") == (head, b"")
    assert ask(port, "/") == ask(port, "/?1") == ask(port, "/index.html")
    for host in (f"hOST:localhost:{port}", f"Cookie: \xff\r\nHost: \t127.0.0.1:{port} \t\r\nAccept:"):
        assert send(port, f"GET / HTTP/1.0\r\n{host}\r\n\r\n".encode("latin-1")) == ask(port, "/")


def test_the_page_of_the_package_is_whole() -> None:
    page = PACKAGE / "page"
    with running(start(None, "-m", "tmcl_sim.studio")) as port:
        names = {path.relative_to(page).as_posix() for path in page.rglob("*") if path.is_file()}
        assert {"index.html", "main.js", "style.css", "tmcl_studio.wasm"} <= names
        for name in sorted(names):
            connection = http.client.HTTPConnection("localhost", port, timeout=PATIENCE)
            connection.request("GET", f"/{name}")
            answer = connection.getresponse()
            assert (answer.status, answer.read()) == (200, (page / name).read_bytes()), name
            assert answer.headers["Content-Type"] == next(
                kind for other, (kind, _) in FILES.items() if Path(other).suffix == Path(name).suffix
            )
            policy, end, _ = answer.headers["Content-Security-Policy"].partition("; frame-ancestors 'none'")
            assert policy.startswith("default-src 'none'; ")
            assert end
            assert f'content="{policy}"' in (page / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "path",
    [
        "/plot",
        "/plot/",
        "/plot/axis",
        "//index.html",
        "/./index.html",
        "/plot/../index.html",
        "/index.html/",
        "/INDEX.HTML",
        "/%69ndex.html",
        "/index.html%00",
        "/.hidden.js",
        "/secret.js",
        "/../secret.js",
        "/../../tmcl_sim/secret.js",
        "/%2e%2e/secret.js",
        "/..%2fsecret.js",
        "/..\\secret.js",
        "/\xff",
    ],
)
def test_nobody_gets_anything_else(port: int, path: str) -> None:
    assert ask(port, path) == NOT_FOUND
    assert ask(port, path, "HEAD") == (NOT_FOUND[0], b"")


def test_only_the_name_of_this_computer_is_meant(port: int) -> None:
    names = ["", "localhost", f"localhost:{port}0", "localhost:80", f"127.0.0.1.example:{port}", f"[::1]:{port}"]
    for host in [*names, f"LOCALHOST:{port}", f"127.0.0.1 :{port}", f"example.org:{port}"]:
        assert send(port, f"GET / HTTP/1.1\r\nHost: {host}\r\n\r\n".encode()) == MISDIRECTED, host
    assert send(port, b"GET / HTTP/1.1\r\n\r\n") == MISDIRECTED
    assert send(port, b"POST /missing HTTP/1.1\r\n\r\n") == MISDIRECTED
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", port), timeout=PATIENCE)


def test_files_are_read_only(port: int) -> None:
    for method in ("POST", "PUT", "OPTIONS", "get", "HEADS"):
        assert ask(port, "/", method) == READ_ONLY, method
    post = f"POST / HTTP/1.1\r\nHost: localhost:{port}\r\nContent-Length: 50000\r\n\r\n".encode()
    assert send(port, post + b"x" * 50_000) == READ_ONLY
    # What follows a request is none, not even another request.
    assert send(port, request(port, "/") + request(port, "/missing")) == ask(port, "/")


@pytest.mark.parametrize(
    "begin",
    [
        "\r\n",
        "GET",
        "GET /",
        "GET / HTTP/1.1\n",
        "GET / HTTP/2.0",
        "GET / HTTP/0.9",
        "GET / HTTP/1.1 ",
        "GET  / HTTP/1.1",
        " GET / HTTP/1.1",
        "\r\nGET / HTTP/1.1",
        "G(T / HTTP/1.1",
        "GET index.html HTTP/1.1",
        "GET http://{host}/ HTTP/1.1",
        "GET /\0 HTTP/1.1",
        "GET /\t HTTP/1.1",
        "GET /\x85 HTTP/1.1",
        "GET / HTTP/1.1\r\nA",
        "GET / HTTP/1.1\r\nA : b",
        "GET / HTTP/1.1\r\n: b",
        "GET / HTTP/1.1\r\nA: b\r\n c: d",
        "GET / HTTP/1.1\r\nA: b\nc: d",
        "GET / HTTP/1.1\r\nA: \x1b[2J",
        "GET / HTTP/1.1\r\nHost: {host}",
        "HEAD / HTTP/1.1\r\nHost: {host}",
    ],
)
def test_what_the_protocol_does_not_have_is_no_request(port: int, begin: str) -> None:
    text = begin.format(host=f"127.0.0.1:{port}") + f"\r\nHost: 127.0.0.1:{port}\r\n\r\n"
    assert send(port, text.encode()) == NO_REQUEST


def test_nor_are_other_bytes(port: int) -> None:
    for other in (b"\x16\x03\x01\x02\0\x01\0\x01\xfc\x03\x03", b"G", request(port, "/")[:-1], request(port, "/")[:-2]):
        assert send(port, other) == NO_REQUEST
    assert send(port, b"") == ("", b"")


def test_a_request_has_a_longest(port: int) -> None:
    def of(length: int, method: str = "GET") -> bytes:
        whole = request(port, "/?", method)
        return whole.replace(b"?", b"?" + b"x" * (length - len(whole)))

    assert len(of(LIMIT)) == LIMIT
    assert send(port, of(LIMIT)) == ask(port, "/")
    for long in (of(LIMIT + 1), of(LIMIT + 1, "HEAD"), of(500_000), b"x" * 500_000):
        assert send(port, long) == TOO_LONG


def test_those_who_ask_nothing_are_in_nobodys_way(port: int) -> None:
    slow = [connect(port) for _ in range(CONNECTIONS - 4)]
    whole = request(port, "/")
    for connection in slow[1:]:
        connection.sendall(whole[:20])
    assert ask(port, "/")[1] == INDEX.encode()
    # They have lost nothing by it.
    for connection in slow[1:]:
        connection.sendall(whole[20:])
        assert rest(connection)[1] == INDEX.encode()
        connection.close()
    slow[0].close()


def test_who_comes_when_all_are_served_is_served_next(port: int) -> None:
    slow = [connect(port) for _ in range(CONNECTIONS + 10)]
    with connect(port) as connection:
        connection.sendall(request(port, "/"))
        assert not select.select([connection], [], [], 0.5)[0]
        for other in slow:
            other.close()
        assert rest(connection)[1] == INDEX.encode()


@pytest.mark.parametrize("beginning", ["", "GET /"])
def test_a_request_has_its_time(folder: Path, beginning: str) -> None:
    """Nobody holds a connection by sending nothing, or little again and again."""
    # The connection may be closed while something is sent.
    with (
        running(start(folder, "-c", WITH_PATIENCE.format(0.2))) as port,
        connect(port) as it,
        suppress(ConnectionError),
    ):
        it.sendall(beginning.encode())
        for _ in range(1000):
            if select.select([it], [], [], 0.05)[0]:
                break
            it.sendall(beginning[-1:].encode())
        else:
            pytest.fail("it is waited for the next piece again and again")
        # Where nothing has come in time, there is nothing to answer.
        assert rest(it) in [("", b""), NO_REQUEST]


def test_whoever_does_not_fetch_the_answer_is_left(folder: Path) -> None:
    with running(start(folder, "-c", WITH_PATIENCE.format(0.2))) as port:
        idle = [connect(port) for _ in range(CONNECTIONS + 10)]
        for connection in idle:
            with suppress(ConnectionError):
                connection.sendall(request(port, "/studio.wasm"))
        # This request may be late as well.
        assert any(ask(port, "/")[1] == INDEX.encode() for _ in range(100))
        for connection in idle:
            connection.close()


def test_ctrl_c_ends_it_without_a_word(folder: Path) -> None:
    process = start(folder, "-m", "tmcl_sim.studio")
    try:
        with connect(port_of(process)):
            process.send_signal(signal.SIGINT)
            assert process.communicate(timeout=PATIENCE) == ("", "")
    finally:
        process.kill()
    # By the signal, which a shell shows as exit code 130.
    assert process.wait() == -signal.SIGINT


def test_in_the_background_it_does_not_hear_ctrl_c(folder: Path) -> None:
    process = start(folder, "-m", "tmcl_sim.studio", hears=False)
    with running(process) as port:
        process.send_signal(signal.SIGINT)
        assert ask(port, "/")[1] == INDEX.encode()


def test_it_serves_at_the_port_that_is_wanted(folder: Path) -> None:
    """Also where connections of an earlier one have not been forgotten yet."""
    for _ in range(5):
        with running(start(folder, "-m", "tmcl_sim.studio", "--port", "0")) as port:
            ask(port, "/")
        # Another program may take the port meanwhile.
        with suppress(ConnectionError), running(start(folder, "-m", "tmcl_sim.studio", f"--port={port}")) as same:
            assert same == port
            assert ask(port, "/")[1] == INDEX.encode()
            return
    pytest.fail("it does not serve at a port that was free")


def end(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    """The exit code of a process that ends by itself, and what it has written."""
    try:
        stdout, stderr = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    return process.returncode, stdout, stderr


def test_a_port_that_is_in_use(folder: Path, port: int) -> None:
    words = f"nothing can be served at port {port}: Address already in use; choose another by --port\n"
    assert end(start(folder, "-m", "tmcl_sim.studio", "--port", str(port))) == (1, "", words)


@pytest.mark.parametrize("port", ["", "x", "-1", "65536", "8080.0", "1_0", "\u0663", "9" * 5000])
def test_what_is_no_port(folder: Path, port: str) -> None:
    code, stdout, stderr = end(start(folder, "-m", "tmcl_sim.studio", f"--port={port}"))
    assert (code, stdout) == (2, "")
    words = f"error: argument --port: a number from 0 to 65535 is wanted, not {port!r}\n"
    assert stderr.endswith(f"python -m tmcl_sim.studio: {words}")


@pytest.mark.parametrize("arguments", [["--port"], ["--prot", "8080"], ["--po", "8080"], ["8080"]])
def test_what_is_no_option(folder: Path, arguments: list[str]) -> None:
    code, stdout, stderr = end(start(folder, "-m", "tmcl_sim.studio", *arguments))
    assert (code, stdout) == (2, "")
    assert stderr.startswith("usage: python -m tmcl_sim.studio ")


def test_help_tells_what_it_is(folder: Path) -> None:
    code, stdout, stderr = end(start(folder, "-m", "tmcl_sim.studio", "--help"))
    assert (code, stderr) == (0, "")
    for words in ("usage: python -m tmcl_sim.studio ", "stepper motor modules", "--port N", "--open", "Ctrl-C"):
        assert words in stdout


def test_a_package_without_the_page_says_where_it_is(tmp_path: Path) -> None:
    page = copy(tmp_path)
    for _ in range(2):
        code, stdout, stderr = end(start(tmp_path, "-m", "tmcl_sim.studio"))
        assert (code, stdout) == (1, "")
        assert stderr.startswith(f"this tmcl-sim has come without the page ({page}): ")
        assert "`cargo studio`" in stderr
        assert "`scripts/wheel`" in stderr
        assert stderr.count("\n") == 1
        # Nor is it there where the folder is.
        page.mkdir(exist_ok=True)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("photo.jpeg", "", "photo.jpeg is no file of a page"),
        ("plot/types.ts", "", "types.ts is no file of a page"),
        ("js", "", "js is no file of a page"),
        ("a.JS", "", "a.JS is no file of a page"),
        ("two words.js", "", "two words.js is no file of a page"),
        ("\u00e9.js", "", ".js is no file of a page"),
        ("a?/b.js", "", "b.js is no file of a page"),
        ("index.html", "<p>", "index.html has 0 policies"),
        ("index.html", META.replace("default", "&amp;"), "index.html has 0 policies"),
        ("index.html", META.replace("default", "\n"), "index.html has 0 policies"),
        ("index.html", META + META, "index.html has 2 policies"),
        ("gone.js", None, "No such file or directory"),
    ],
)
def test_a_page_that_is_not_whole_is_not_served(tmp_path: Path, name: str, text: str | None, words: str) -> None:
    page = copy(tmp_path)
    put(page, FILES)
    if text is None:
        (page / name).symlink_to("missing.js")
    else:
        put(page, {name: ("", text.encode())})
    code, stdout, stderr = end(start(tmp_path, "-m", "tmcl_sim.studio"))
    assert (code, stdout) == (1, "")
    assert stderr.startswith("the page of tmcl-sim is not whole (")
    assert words in stderr
    assert stderr.endswith("): install the package anew\n")


def test_a_full_disk(folder: Path) -> None:
    with open("/dev/full", "w") as full:
        code, _, stderr = end(start(folder, "-m", "tmcl_sim.studio", stdout=full.fileno()))
    assert (code, stderr) == (1, "nothing can be printed: No space left on device\n")


def test_the_browser_is_opened(folder: Path, tmp_path: Path) -> None:
    browser = tmp_path / "browser"
    browser.write_text('#!/bin/sh\ncd "${0%/*}" && echo "$1" >opened.new && mv opened.new opened\n')
    browser.chmod(0o755)
    process = start(folder, "-m", "tmcl_sim.studio", "--open", environment={"BROWSER": str(browser)})
    with running(process) as port:
        until = time.monotonic() + PATIENCE
        while not (tmp_path / "opened").exists():
            assert time.monotonic() < until, "no browser is started"
            time.sleep(0.01)
        assert (tmp_path / "opened").read_text() == f"http://127.0.0.1:{port}/\n"
        assert ask(port, "/")[1] == INDEX.encode()


@pytest.mark.parametrize("browser", ["false", "missing", "'%s", " "])
def test_without_a_browser_the_page_is_served(folder: Path, tmp_path: Path, browser: str) -> None:
    # With no other program on the path, and no screen, there is no browser.
    (tmp_path / "false").symlink_to("/bin/false")
    environment = {"BROWSER": browser, "PATH": str(tmp_path), "DISPLAY": "", "WAYLAND_DISPLAY": ""}
    process = start(folder, "-m", "tmcl_sim.studio", "--open", environment=environment)
    with running(process) as port:
        assert told(process.stderr, "\n") == "no browser can be started: open the address above yourself\n"
        assert ask(port, "/")[1] == INDEX.encode()
