"""Whether the tests notice a mutant."""

import os
import signal
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence

from build import Test

# How much longer than without a mutant a test may take; a mutant that makes something go on for ever is noticed so.
LONGER = 4
# What a busy computer takes at any time, in seconds.
PATIENCE = 60


def run(test: Test, environment: Mapping[str, str], limit: float | None, skipped: Sequence[str] = ()) -> str | None:
    """Runs one binary of tests, without some of them; returns what was noticed, `None` if all has passed."""
    said, code = output(test, test.all_but(skipped), environment, limit)
    if code is None:
        return "does not end"
    failed = next(filter(None, map(test.failed, said)), None)
    if failed is None:
        return None if code == 0 else f"exit code {code}"
    # On a busy computer a test may fail that has seen nothing of the mutant: so it has to fail alone as well.
    if output(test, test.only(failed), environment, limit)[1] == 0:
        return run(test, environment, limit, [*skipped, failed])
    return f"test {failed}"


def output(
    test: Test, command: Sequence[str], environment: Mapping[str, str], limit: float | None
) -> tuple[list[str], int | None]:
    """The lines of a binary of tests up to the first that fails, and its exit code; `None` if it does not end."""
    process = subprocess.Popen(
        command, cwd=test.folder, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        # A group, so that its children end with it, and not a session: the first terminal that a test opens would become that of
        # the session, whose end is the end of its leader.
        process_group=0,
    )  # fmt: skip
    late = threading.Event()

    def end() -> None:
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass

    timer = threading.Timer(limit, lambda: (late.set(), end())) if limit else None
    if timer:
        timer.start()
    lines: list[str] = []
    try:
        for line in process.stdout:
            lines.append(line.decode(errors="replace").strip())
            # The first that fails is enough.
            if test.failed(lines[-1]):
                return lines, 1
        code = process.wait()
    finally:
        if timer:
            timer.cancel()
        end()
        process.wait()
    return lines, None if late.is_set() else code


def verdict(tests: Sequence[Test], times: Mapping[str, float], environment: Mapping[str, str]) -> str | None:
    """What noticed the mutant that the environment chooses: a test by its name; `None` if it survives."""
    for test in tests:
        said = run(test, environment, LONGER * times[key(test)] + PATIENCE)
        if said is not None:
            return f"{test.name}: {said}"
    return None


def key(test: Test) -> str:
    return f"{test.folder.name}/{test.name}"


def times_without_mutants(tests: Sequence[Test], environment: Mapping[str, str]) -> dict[str, float]:
    """How long each takes in seconds; they must pass."""
    times = {}
    for test in tests:
        before = time.monotonic()
        said = run(test, environment, None)
        if said is not None:
            raise SystemExit(f"without a mutant {test.name} fails: {said}")
        times[key(test)] = time.monotonic() - before
    return times
