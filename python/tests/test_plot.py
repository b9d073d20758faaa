"""Plots, drawn from curves that are known."""

from __future__ import annotations

from xml.etree import ElementTree

from tmcl_sim.plot import Curve, Mark, Panel, as_svg, as_text

SVG = "{http://www.w3.org/2000/svg}"
RAMP = Curve("axis 0", [(second, 1000.0 * second) for second in range(9)])
LEVEL = Curve("axis 1", [(second, -5.0) for second in range(9)])


def test_a_curve_in_characters() -> None:
    assert as_text([Panel("position in microsteps", [RAMP, LEVEL])]).splitlines() == [
        "axis 0: position in microsteps",
        "8 000 |                                                               *",
        "      |                                                       *",
        "      |                                               *",
        "      |                                       *",
        "      |                                *",
        "      |                        *",
        "      |                *",
        "      |        *",
        "    0 |*",
        "      +----------------------------------------------------------------",
        "       0.000 s                                                  8.000 s",
        "",
        "axis 1: position in microsteps: -5 all the time",
    ]


def test_marks_in_characters() -> None:
    told = as_text([Panel("speed", [RAMP])], [Mark(-1.0, "press left"), Mark(4.0, "load 1")]).splitlines()
    # The axis begins with the first mark: nine seconds have 63 columns, and 4 s are five of them.
    assert told[10:] == [
        "      +^----------------------------------^----------------------------",
        "       -1.000 s                                                 8.000 s",
        "",
        "^ what has happened",
        "-1.000 s  press left",
        "4.000 s  load 1",
    ]


def test_marks_in_an_image() -> None:
    marks = [Mark(0.0, "press left"), Mark(0.0, "load < 1"), Mark(8.0, "power off")]
    image = ElementTree.fromstring(as_svg("marks", [Panel("position", [RAMP]), Panel("speed", [LEVEL])], marks))
    broken = [path.get("d") for path in image.iter(f"{SVG}path") if path.get("stroke-dasharray")]
    # Lines at both ends, through both panels.
    assert broken == ["M110.0 78V298", "M976.0 78V298", "M110.0 344V564", "M976.0 344V564"]
    turned = [text.text for text in image.iter(f"{SVG}text") if "rotate(-90" in text.get("transform", "")]
    assert turned == ["press left, load < 1", "power off"] * 2


def test_an_image() -> None:
    image = ElementTree.fromstring(as_svg("a < b", [Panel("position", [RAMP, LEVEL]), Panel("speed", [LEVEL])]))
    lines = [line.get("points", "").split() for line in image.iter("{http://www.w3.org/2000/svg}polyline")]
    assert [len(points) for points in lines] == [9, 9, 9]
    assert (lines[0][0], lines[0][-1]) == ("110.0,297.9", "976.0,78.0")
    texts = [text.text for text in image.iter("{http://www.w3.org/2000/svg}text")]
    assert texts[0] == "a < b"
    assert {"position", "speed", "axis 0", "axis 1", "2 000", "8 000", "virtual time in seconds"} <= set(texts)


def test_where_all_stands_in_an_image() -> None:
    """866 pixels for 8 s and 220 for 1 001 500 microsteps, below 32 for the title and 46 above the panel; a label
    stands 4 pixels below the middle of its line."""
    curve = Curve("axis 0", [(0.0, -1500.0), (2.5, 1_000_000.0), (4.0, 12.5)])
    image = ElementTree.fromstring(as_svg("small", [Panel("position", [curve, LEVEL])], [Mark(0.1, "press left")]))
    assert (image.get("viewBox"), image.get("width"), image.get("height")) == ("0 0 1000 332", "1000", "332")
    texts = [(text.text, float(text.get("x", "")), float(text.get("y", ""))) for text in image.iter(f"{SVG}text")]
    levels = [("0", 301.7), ("200 000", 257.7), ("400 000", 213.8), ("600 000", 169.9), ("800 000", 125.9)]
    times = [("0", 110.0), ("2", 326.5), ("4", 543.0), ("6", 759.5), ("8", 976.0)]
    assert texts == [
        ("small", 110.0, 28.0),
        ("position", 110.0, 70.0),
        *[(text, 102.0, y) for text, y in [*levels, ("1 000 000", 82.0)]],
        *[(text, x, 314.0) for text, x in times],
        ("press left", 132.8, 292.0),
        ("axis 0", 876.0, 70.0),
        ("axis 1", 976.0, 70.0),
        ("virtual time in seconds", 543.0, 326.0),
    ]
    grid = [f"M110 {y}H976" for y in ("297.7", "253.7", "209.8", "165.9", "121.9", "78.0")]
    grid += [f"M{x} 78V298" for _, x in times] + ["M120.8 78V298"]
    assert [path.get("d") for path in image.iter(f"{SVG}path")] == grid
    points = [line.get("points", "") for line in image.iter(f"{SVG}polyline")]
    assert points[0] == "110.0,298.0 380.6,78.0 543.0,297.7"
    # A word that would stand beyond the left end stands to the right of its line, another one to the left.
    late = ElementTree.fromstring(as_svg("small", [Panel("position", [LEVEL])], [Mark(4.0, "press left")]))
    turned = [text for text in late.iter(f"{SVG}text") if text.text == "press left"]
    assert [(text.get("x"), text.get("transform")) for text in turned] == [("539.0", "rotate(-90 539.0 292)")]


def test_a_level_curve_has_a_scale() -> None:
    image = ElementTree.fromstring(as_svg("level", [Panel("speed", [LEVEL])]))
    texts = [text.text for text in image.iter(f"{SVG}text")]
    assert texts[2:7] == ["-6", "-5.5", "-5", "-4.5", "-4"]
    points = {line.get("points", "").split()[0] for line in image.iter(f"{SVG}polyline")}
    assert points == {"110.0,188.0"}
