"""Plots, drawn from curves that are known."""

from __future__ import annotations

from xml.etree import ElementTree

from tmcl_sim.plot import Curve, Panel, as_svg, as_text

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


def test_an_image() -> None:
    image = ElementTree.fromstring(as_svg("a < b", [Panel("position", [RAMP, LEVEL]), Panel("speed", [LEVEL])]))
    lines = [line.get("points", "").split() for line in image.iter("{http://www.w3.org/2000/svg}polyline")]
    assert [len(points) for points in lines] == [9, 9, 9]
    assert (lines[0][0], lines[0][-1]) == ("110.0,297.9", "976.0,78.0")
    texts = [text.text for text in image.iter("{http://www.w3.org/2000/svg}text")]
    assert texts[0] == "a < b"
    assert {"position", "speed", "axis 0", "axis 1", "2 000", "8 000", "virtual time in seconds"} <= set(texts)
