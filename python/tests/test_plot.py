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
