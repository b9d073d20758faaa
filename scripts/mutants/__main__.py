"""Puts the tests to the test: changes the sources in one place at a time and sees whether a test notices.

Each change, a mutant, is small: another operator, a number that is one more, a statement that is left out. One that no test
notices has survived; either a test is missing, or the change makes no difference to anybody.
"""

import argparse
import fcntl
import itertools
import random
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from areas import AREAS
from build import Copy, ordered
from mutant import Form, Mutant
from verdict import times_without_mutants, verdict

CHECKOUT = Path(__file__).resolve().parents[2]


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/mutate", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("area", choices=AREAS, nargs="+", help="the part of the sources: %(choices)s")
    parser.add_argument("--sample", type=int, default=20, metavar="N", help="so many mutants of each area, 0 for all (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="which ones (default %(default)s)")
    parser.add_argument("--match", default="", metavar="TEXT", help="only those whose place or change contains TEXT")
    parser.add_argument("--list", action="store_true", help="name the mutants, and run nothing")
    return parser.parse_args()


def alone_here() -> IO[str]:
    """The lock of this checkout's copy, which two runs would overwrite for each other; it lasts as long as the file is open."""
    folder = CHECKOUT / "target" / "mutants"
    folder.mkdir(parents=True, exist_ok=True)
    lock = (folder / "lock").open("w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        sys.exit("scripts/mutate: another one is running in this checkout; wait for its end, or use another checkout")
    return lock


def main() -> None:
    said = arguments()
    _lock = alone_here()
    # Areas with the same tests are built together.
    together: dict[tuple, list[str]] = {}
    for name in dict.fromkeys(said.area):
        together.setdefault((AREAS[name].crate, AREAS[name].packages), []).append(name)
    rows = [row for names in together.values() for row in tried(names, said)]
    if rows:
        print("\n| area | mutants tried | noticed | survived |\n| --- | --- | --- | --- |")
        print("\n".join(f"| {name} | {count} | {count - survived} | {survived} |" for name, count, survived in rows))


def tried(names: list[str], said: argparse.Namespace) -> list[tuple[str, int, int]]:
    """Tries a sample of each of these areas; returns how many of it were tried and how many survived."""
    copy = Copy(CHECKOUT, [AREAS[name] for name in names])
    samples: dict[str, list[Mutant]] = {}
    for name in names:
        every = [mutant for mutant in copy.mutants(AREAS[name]) if said.match in f"{mutant.place()} {mutant.what}"]
        samples[name] = random.Random(said.seed).sample(every, min(said.sample or len(every), len(every)))
        print(f"{name}: {len(samples[name])} of {len(every)} mutants", flush=True)
        if said.list:
            print("\n".join(f"  {mutant.place()}  {mutant.what}" for mutant in samples[name]))
    if said.list:
        return []
    numbers = itertools.count(1)
    numbered = {name: {next(numbers): mutant for mutant in sample} for name, sample in samples.items()}
    choices = {number: it for sample in numbered.values() for number, it in sample.items() if it.form is not Form.ALONE}
    tests, unbuilt = copy.with_all(choices)
    print(f"{len(tests)} binaries of tests are built", flush=True)
    times = times_without_mutants(tests, copy.environment)
    print(f"without a mutant they pass, in {sum(times.values()):.0f} s", flush=True)
    # Those that need a build of their own come last: what has been built is gone then.
    of_area = {name: Counted() for name in names}
    everything = [(name, number, it) for name, sample in numbered.items() for number, it in sample.items()]
    for name, number, mutant in sorted(everything, key=lambda one: one[2].form is Form.ALONE):
        before = time.monotonic()
        environment = copy.environment
        if mutant.form is Form.ALONE:
            these = copy.with_one(mutant)
        else:
            these = None if number in unbuilt else tests
            environment = {**environment, "MUTANT": str(number)}
        if these is None:
            print(f"  {name}: {mutant.place()}  {mutant.what}: does not compile", flush=True)
            continue
        noticed = verdict(ordered(these, AREAS[name]), times, environment)
        of_area[name].add(noticed is None)
        print(f"  {name}: {mutant.place()}  {mutant.what}: {noticed or 'SURVIVES'} ({time.monotonic() - before:.0f} s)", flush=True)
    copy.original()
    return [(name, count.tried, count.survived) for name, count in of_area.items()]


@dataclass
class Counted:
    """What was found out about an area."""

    tried: int = 0
    survived: int = 0

    def add(self, survives: bool) -> None:
        self.tried += 1
        self.survived += survives


if __name__ == "__main__":
    sys.exit(main())
