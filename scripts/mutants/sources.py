"""The sources with all mutants in them, of which the environment variable MUTANT chooses one by its number."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mutant import Form, Mutant


@dataclass
class Placed:
    """Where the choice of a mutant stands in the changed file."""

    number: int
    start: int
    end: int


def with_choices(
    source: bytes, mutants: Sequence[tuple[int, Mutant]], chosen: Callable[[Mutant, int, bytes], bytes]
) -> tuple[bytes, list[Placed]]:
    """The file with the choice of each mutant, and where these stand. Mutants may stand within others."""
    # Outer ones before those within them.
    ordered = sorted(mutants, key=lambda pair: (pair[1].start, -pair[1].end))
    placed: list[Placed] = []

    def part(start: int, end: int, rest: list[tuple[int, Mutant]], at: int) -> bytes:
        """What becomes of `start..end`, which stands at `at`, with the mutants that are within it."""
        text = b""
        here = start
        while rest:
            number, outer = rest.pop(0)
            within = []
            while rest and rest[0][1].start < outer.end:
                within.append(rest.pop(0))
            text += source[here : outer.start]
            # The text of the original moves behind what the choice puts before it, which is found out by a mark.
            before = chosen(outer, number, b"\0").index(b"\0") if outer.form is not Form.ARM else 0
            place = at + len(text)
            inner = part(outer.start, outer.end, within, place + before)
            whole = chosen(outer, number, inner)
            placed.append(Placed(number, place, place + len(whole)))
            text += whole
            here = outer.end
        return text + source[here:end]

    return part(0, len(source), ordered, 0), placed


def alone(source: bytes, mutant: Mutant) -> bytes:
    """The file with the one mutant in place of the original."""
    return source[: mutant.start] + mutant.text + source[mutant.end :]


def at_fault(placed: Sequence[Placed], start: int, end: int) -> set[int]:
    """The numbers of the mutants that a message of the compiler about `start..end` may be about: the innermost choice around
    it and, if there is none, those within it."""
    around = [it for it in placed if it.start <= start and end <= it.end]
    if around:
        return {min(around, key=lambda it: it.end - it.start).number}
    return {it.number for it in placed if start < it.end and it.start < end}
