"""Plots of values over virtual time: as an SVG image, and in text characters for a terminal. Drawn without
dependencies. There are two moments at least, as a line needs them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

# Size of the text plot, in characters.
COLUMNS, ROWS = 64, 9
# Size of the image and of what surrounds its panels, in pixels.
WIDTH, PANEL, LEFT, RIGHT, TOP, BOTTOM, GAP = 1000, 220, 110, 24, 32, 34, 46
# Height of the letters of the image, in pixels.
LETTERS = 12
# Colours that people with any eyes tell apart (Okabe and Ito).
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
GRID, QUIET, MARK = "#d9dde1", "#666", "#a0522d"


@dataclass(frozen=True)
class Curve:
    """A value over time: its name, and points of time in seconds and value."""

    name: str
    points: Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Panel:
    """Curves with one scale; the title has their unit."""

    title: str
    curves: Sequence[Curve]


@dataclass(frozen=True)
class Mark:
    """Something that has happened at a moment."""

    time: float
    """Virtual time in seconds."""
    what: str
    """What it was."""


def as_text(panels: Sequence[Panel], marks: Sequence[Mark] = ()) -> str:
    """The plot in text characters, with a `^` on the axis of time for each mark, and the marks in words at the end. A
    curve that stays the same all the time is a line of text."""
    begin, end = _ends(panels, marks)
    blocks = []
    for panel in panels:
        for curve in panel.curves:
            title = f"{curve.name}: {panel.title}"
            values = [value for _, value in curve.points]
            if not values:
                continue
            if min(values) == max(values):
                blocks.append(f"{title}: {_number(values[0])} all the time")
            else:
                blocks.append(f"{title}\n{_characters(curve, begin, end, marks)}")
    if marks:
        blocks.append("\n".join(["^ what has happened"] + [f"{mark.time:.3f} s  {mark.what}" for mark in marks]))
    return "\n\n".join(blocks)


def _characters(curve: Curve, begin: float, end: float, marks: Sequence[Mark]) -> str:
    """A curve that is not level."""
    values = [value for _, value in curve.points]
    low, high = min(values), max(values)
    cells = [[" "] * COLUMNS for _ in range(ROWS)]

    def column(time: float) -> int:
        return round((time - begin) / (end - begin) * (COLUMNS - 1))

    for time, value in curve.points:
        row = round((value - low) / (high - low) * (ROWS - 1))
        cells[ROWS - 1 - row][column(time)] = "*"
    labels = {0: _number(high), ROWS - 1: _number(low)}
    margin = max(len(label) for label in labels.values())
    lines = [f"{labels.get(row, ''):>{margin}} |{''.join(line).rstrip()}" for row, line in enumerate(cells)]
    first, last = f"{begin:.3f} s", f"{end:.3f} s"
    marked = {column(mark.time) for mark in marks}
    line = "".join("^" if place in marked else "-" for place in range(COLUMNS))
    axis = [" " * margin + " +" + line, " " * (margin + 2) + first + f"{last:>{COLUMNS - len(first)}}"]
    return "\n".join(lines + axis)


def as_svg(title: str, panels: Sequence[Panel], marks: Sequence[Mark] = ()) -> str:
    """The plot as an SVG image, with a broken line for each mark, and what it was along it."""
    height = TOP + len(panels) * (GAP + PANEL) + BOTTOM
    begin, end = _ends(panels, marks)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" '
        'font-family="DejaVu Sans, Verdana, Helvetica, Arial, sans-serif" '
        f'font-size="{LETTERS}" fill="#222">',
        f"<title>{escape(title)}</title>",
        '<rect width="100%" height="100%" fill="#fff"/>',
        _label(LEFT, 28, title, 'font-size="17" font-weight="bold"'),
    ]
    for number, panel in enumerate(panels):
        top = TOP + number * (GAP + PANEL) + GAP
        parts += _panel(panel, top, begin, end, marks)
    parts += [_label((LEFT + WIDTH - RIGHT) / 2, height - 6, "virtual time in seconds", _middle(QUIET)), "</svg>"]
    return "\n".join(parts) + "\n"


def _panel(panel: Panel, top: float, begin: float, end: float, marks: Sequence[Mark]) -> Iterable[str]:
    """A panel from `top` down, with its grid, its marks and its curves."""
    values = [value for curve in panel.curves for _, value in curve.points] or [0.0]
    low, high = _apart(min(values), max(values))
    bottom, right = top + PANEL, WIDTH - RIGHT

    def x(time: float) -> float:
        return LEFT + (time - begin) / (end - begin) * (right - LEFT)

    def y(value: float) -> float:
        return bottom - (value - low) / (high - low) * PANEL

    yield _label(LEFT, top - 8, panel.title, 'font-weight="bold"')
    for tick in _ticks(low, high):
        yield f'<path d="M{LEFT} {y(tick):.1f}H{right}" stroke="{GRID}"/>'
        yield _label(LEFT - 8, y(tick) + 4, _number(tick), 'text-anchor="end"')
    for tick in _ticks(begin, end):
        yield f'<path d="M{x(tick):.1f} {top}V{bottom}" stroke="{GRID}"/>'
        yield _label(x(tick), bottom + 16, _number(tick), _middle("#222"))
    for time, together in itertools.groupby(marks, lambda mark: mark.time):
        yield f'<path d="M{x(time):.1f} {top}V{bottom}" stroke="{MARK}" stroke-dasharray="4 3"/>'
        # Upwards along its line; to the right of it, where the panel begins.
        beside = x(time) - 4 if x(time) - LETTERS > LEFT else x(time) + LETTERS
        turned = f'transform="rotate(-90 {beside:.1f} {bottom - 6})" fill="{MARK}"'
        yield _label(beside, bottom - 6, ", ".join(mark.what for mark in together), turned)
    for number, curve in enumerate(panel.curves):
        colour = COLOURS[number % len(COLOURS)]
        points = " ".join(f"{x(time):.1f},{y(value):.1f}" for time, value in curve.points)
        yield f'<polyline points="{points}" stroke="{colour}" stroke-width="1.5" stroke-linejoin="round" fill="none"/>'
        place = right - 100 * (len(panel.curves) - number - 1)
        yield _label(place, top - 8, curve.name, f'text-anchor="end" fill="{colour}"')


def _label(x: float, y: float, text: str, style: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{escape(text)}</text>'


def _middle(colour: str) -> str:
    return f'text-anchor="middle" fill="{colour}"'


def _ends(panels: Sequence[Panel], marks: Sequence[Mark]) -> tuple[float, float]:
    """The first and the last time."""
    times = [time for panel in panels for curve in panel.curves for time, _ in curve.points]
    times += [mark.time for mark in marks]
    return min(times), max(times)


def _apart(low: float, high: float) -> tuple[float, float]:
    """The ends of a scale, which are not the same."""
    return (low, high) if low < high else (low - 1, high + 1)


def _ticks(low: float, high: float) -> list[float]:
    """Some five round numbers on a scale: 1, 2 or 5 times a power of ten apart."""
    rough = (high - low) / 6
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= rough)
    return [number * step for number in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _number(value: float) -> str:
    """A number with its thousands apart."""
    return f"{value:,.6g}".replace(",", " ") if abs(value) < 1e6 else f"{value:,.0f}".replace(",", " ")
