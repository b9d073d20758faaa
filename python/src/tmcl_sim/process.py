"""The process of a simulator: started, and ended without a trace, however this interpreter ends.

The simulator ends when its standard input does, and that is a pipe which closes even if this interpreter is killed.
What it writes goes to files without a name, which the system removes with the last process that has them open. Links to
its serial ports stand in the folder for temporary files, and the simulator removes them itself."""

from __future__ import annotations

import json
import os
import secrets
import subprocess
import tempfile
import weakref
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from .errors import Died, SimError, StartError

# pytest leaves the frames of this file out of tracebacks: the line of the test is what matters.
__tracebackhide__ = True

# How many seconds the simulator has for its end before it is killed. It takes some milliseconds.
PATIENCE = 10
# How many lines of its standard error an exception tells.
LAST_LINES = 20
# How many bytes at the end of a file are read first, to find its last lines.
WINDOW = 4096
# What `tmcl` adds for somebody at a terminal when an argument is wrong.
HINT = "For more information, try '--help'."


class Process:
    """A simulator that runs; what it tells when it is ready is in `ready`.

    `arguments` are those of `tmcl sim`. `log` is the file of its telegrams; without one they go to a file without a
    name."""

    def __init__(self, program: str, arguments: Sequence[str], links: Sequence[str], log: str | None):
        self._owner = os.getpid()
        self._links = links
        self._ended = False
        self._stderr: IO[bytes] = tempfile.TemporaryFile()
        self._log: IO[bytes] | None = None if log else tempfile.TemporaryFile()
        shared = [self._log.fileno()] if self._log else []
        where = log or f"/dev/fd/{shared[0]}"
        try:
            self._popen = subprocess.Popen(
                [program, "sim", "--ready-json", "--exit-with-stdin", "--log-telegrams", where, *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._stderr,
                pass_fds=shared,
                # Ctrl-C at the terminal is for this interpreter; what becomes of the simulator is decided here.
                start_new_session=True,
            )
        # A ValueError is an argument with a character that no argument can have.
        except (OSError, ValueError) as error:
            self._close_files()
            raise StartError(f"{program} cannot be started: {error}") from None
        _running.add(self)
        try:
            self.ready: dict[str, Any] = self._await_ready(program)
            if log:
                self._log = open(log, "rb")
        except BaseException:
            self.end()
            raise

    def _await_ready(self, program: str) -> dict[str, Any]:
        assert self._popen.stdout is not None
        with self._popen.stdout as pipe:
            line = pipe.readline()
        try:
            return dict(json.loads(line))
        except (ValueError, TypeError):
            self._end_process()
            said = (
                self.last_lines().removesuffix(HINT).rstrip()
                or f"{program} has ended with exit code {self._popen.returncode} before it was ready"
            )
            raise StartError(said) from None

    @property
    def is_own(self) -> bool:
        """False in a fork of the process that has started the simulator."""
        return self._owner == os.getpid()

    def check(self) -> None:
        """Raises an exception if the simulator cannot be asked: it was closed, it has died, or it belongs to the
        process of which this one is a fork."""
        if not self.is_own:
            raise SimError("this Sim belongs to the process that has forked this one; start another Sim here")
        if self._ended:
            raise SimError("this Sim is closed")
        if (code := self._popen.poll()) is not None:
            raise Died(code, self.last_lines())

    def gone(self) -> SimError:
        """Why the simulator has closed a connection: most likely it has died."""
        try:
            return Died(self._popen.wait(PATIENCE), self.last_lines())
        except subprocess.TimeoutExpired:
            return SimError("the simulator has closed the control connection, although it still runs")

    def last_lines(self) -> str:
        """The last lines of its standard error."""
        return "\n".join(_lines(self._stderr, LAST_LINES))

    def telegrams(self, last: int | None) -> list[str]:
        """The lines of its log of telegrams so far, or the last of them, also when it has died."""
        if self._log is None or self._log.closed:
            self.check()
        assert self._log is not None
        return _lines(self._log, last)

    def end(self) -> None:
        """Ends the process, waits for its end, and removes what it leaves. A second time does nothing, and so does a
        fork."""
        if self._ended or not self.is_own:
            return
        self._ended = True
        _running.discard(self)
        self._end_process()
        # The simulator removes the links itself, unless it was killed.
        for link in self._links:
            with suppress(FileNotFoundError):
                os.unlink(link)
        self._close_files()

    def _end_process(self) -> None:
        assert self._popen.stdin is not None
        self._popen.stdin.close()
        try:
            self._popen.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._popen.kill()
            self._popen.wait()

    def abandon(self) -> None:
        """Lets go of a process that belongs to the parent of this fork, which has a copy of all that the parent has
        open: while the copy of the pipe is open, the simulator would not notice the end of the parent."""
        assert self._popen.stdin is not None
        self._popen.stdin.close()
        # So that this copy neither waits for a process that is not its child, nor warns of it.
        self._popen.returncode = 0
        self._close_files()

    def _close_files(self) -> None:
        self._stderr.close()
        if self._log:
            self._log.close()


def link_path(what: str) -> str:
    """A path for a link to a serial port, in the folder for temporary files; no other has it."""
    return str(Path(tempfile.gettempdir()) / f"tmcl-sim-{what}-{secrets.token_hex(8)}")


def _lines(file: IO[bytes], last: int | None) -> list[str]:
    """The lines of a file that another process writes, whose place in it may be shared; or the last of them, for which
    no more of it is read than they need."""
    descriptor = file.fileno()
    size = os.fstat(descriptor).st_size
    length = size if last is None else min(size, WINDOW)
    while True:
        lines = os.pread(descriptor, length, size - length).decode(errors="replace").splitlines()
        if last is not None and len(lines) > last:
            return lines[len(lines) - last :]
        if length == size:
            return lines
        length = min(size, 2 * length)


_running: weakref.WeakSet[Process] = weakref.WeakSet()


def _abandon_all() -> None:
    for process in list(_running):
        process.abandon()
    _running.clear()


os.register_at_fork(after_in_child=_abandon_all)
