"""Puts the tests to the test: changes the sources in one place at a time and sees whether a test notices.

Each change, a mutant, is small: another operator, a number that is one more, a statement that is left out. One that no test
notices has survived; either a test is missing, or the change makes no difference to anybody.
"""

import argparse
import random
import sys
import time
from pathlib import Path

from areas import AREAS
from build import Copy, ordered
from mutant import Form
from verdict import times_without_mutants, verdict


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/mutate", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("area", choices=AREAS, nargs="+", help="the part of the sources: %(choices)s")
    parser.add_argument("--sample", type=int, default=20, metavar="N", help="so many mutants of each area, 0 for all (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="which ones (default %(default)s)")
    parser.add_argument("--match", default="", metavar="TEXT", help="only those whose place or change contains TEXT")
    parser.add_argument("--list", action="store_true", help="name the mutants, and run nothing")
    return parser.parse_args()


def main() -> None:
    said = arguments()
    rows = [row for name in said.area if (row := one_area(name, said))]
    if rows:
        print("\n| area | mutants tried | noticed | survived |\n| --- | --- | --- | --- |")
        print("\n".join(f"| {name} | {tried} | {tried - survived} | {survived} |" for name, tried, survived in rows))


def one_area(name: str, said: argparse.Namespace) -> tuple[str, int, int] | None:
    checkout = Path(__file__).resolve().parents[2]
    area = AREAS[name]
    copy = Copy(checkout, area)
    every = [mutant for mutant in copy.mutants() if said.match in f"{mutant.place()} {mutant.what}"]
    sample = random.Random(said.seed).sample(every, min(said.sample or len(every), len(every)))
    print(f"{name}: {len(sample)} of {len(every)} mutants", flush=True)
    if said.list:
        print("\n".join(f"  {mutant.place()}  {mutant.what}" for mutant in sample))
        return None
    numbered = dict(enumerate(sample, 1))
    tests, unbuilt = copy.with_all({number: it for number, it in numbered.items() if it.form is not Form.ALONE})
    tests = ordered(tests, area)
    print(f"{name}: {len(tests)} binaries of tests are built", flush=True)
    times = times_without_mutants(tests, copy.environment)
    print(f"{name}: without a mutant they pass, in {sum(times.values()):.0f} s", flush=True)
    tried = survived = 0
    for number, mutant in sorted(numbered.items(), key=lambda pair: pair[1].form is Form.ALONE):
        before = time.monotonic()
        environment = copy.environment
        if mutant.form is Form.ALONE:
            these = copy.with_one(mutant)
            these = these and ordered(these, area)
        else:
            these = None if number in unbuilt else tests
            environment = {**environment, "MUTANT": str(number)}
        if these is None:
            print(f"  {mutant.place()}  {mutant.what}: does not compile", flush=True)
            continue
        noticed = verdict(these, times, environment)
        tried += 1
        survived += noticed is None
        print(f"  {mutant.place()}  {mutant.what}: {noticed or 'SURVIVES'} ({time.monotonic() - before:.0f} s)", flush=True)
    copy.original()
    return name, tried, survived


if __name__ == "__main__":
    sys.exit(main())
