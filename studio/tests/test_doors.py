"""The WebAssembly itself: what it imports, and the same numbers as natively."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest
from bed.browser import Browser
from bed.module import PROGRAM, ROOT
from bed.server import Site
from studio import FOLDER

HERE = Path(__file__).parent


@pytest.mark.parametrize("program", ["tmcl_studio.wasm", "tmcl_studio_image.wasm"])
def test_nothing_is_imported_but_wire_and_stop(plain_chromium: Browser, studio_site: Site, program: str) -> None:
    page = plain_chromium.open(studio_site.url)
    names = page.evaluate(
        """async program => WebAssembly.Module.imports(await WebAssembly.compileStreaming(fetch(program)))
            .map(({ module, name }) => `${module}.${name}`).sort()""",
        program,
    )
    assert names == ["stop.forget", "stop.within", "wire.exchange", "wire.pause", "wire.time"]


# Asks for more room than there can be, so that the Rust panics.
PANIC = """async () => {
    const { Doors, NOBODY } = await import("/doors.js");
    const doors = await Doors.open(await WebAssembly.compileStreaming(fetch("tmcl_studio.wasm")), NOBODY, false);
    doors.ask("products");
    const { room, ...others } = doors.exports;
    doors.exports = { ...others, room, products: () => room(-1) };
    try {
        doors.ask("products");
    } catch (error) {
        return [error.constructor.name, error.message];
    }
}"""


def test_a_panic_is_told_with_its_words_and_place(plain: Browser, studio_site: Site) -> None:
    kind, words = plain.open(studio_site.url).evaluate(PANIC)
    assert kind == "Dead"
    assert "capacity overflow" in words, words
    assert ".rs:" in words, words


# Of the state, what depends on the clock and not on the module.
OF_THE_CLOCK = re.compile(r',"speed_factor":[0-9.]+')


def sequence() -> list[dict[str, object]]:
    """Moves, loads, switches and 2000 samples of each product."""

    def ask(opcode: int, kind: int, motor: int, value: int) -> dict[str, object]:
        return {"ask": {"address": 1, "opcode": opcode, "kind": kind, "motor": motor, "value": value}}

    def control(line: str) -> dict[str, object]:
        return {"control": {"line": line}}

    steps: list[dict[str, object]] = []
    for product, axes in (("1110", 1), ("1140", 1), ("3110", 3), ("3212", 3), ("6110", 6)):
        last = axes - 1
        steps += [{"start": {"product": product, "world": None}}, control("pause")]
        steps += [ask(4, 0, axis, 20_000 * (axis + 1)) for axis in range(axes)]
        steps += [control("step 300 ms"), control(f"load 0.3 {last}"), control("state"), control(f"press right {last}")]
        steps += [
            control("watch 1 ms position velocity rotor current load stall_guard"),
            control("step 2 s"),
            control("unwatch"),
        ]
        steps += [control(f"release right {last}"), ask(1, 0, last, 700), control("step 500 ms"), ask(3, 0, last, 0)]
        steps += [ask(6, 1, axis, 0) for axis in range(axes)]
        steps += [ask(13, 0, 0, 0), control("step 1 s"), control("slip 40"), control("state"), ask(6, 255, 0, 0)]
    return steps


IN_THE_BROWSER = """async steps => {
    const { Doors, NOBODY } = await import("/doors.js");
    const module = await WebAssembly.compileStreaming(fetch("tmcl_studio.wasm"));
    const doors = await Doors.open(module, NOBODY, false);
    const said = [];
    for (const { start, ask, control } of steps) {
        if (start) {
            doors.ask("virtual_start", start);
            continue;
        }
        doors.ask(ask ? "virtual_ask" : "virtual_control", ask ?? control);
        for (let over = false; !over;) {
            const { lines, replies } = doors.ask("virtual_turn");
            said.push(...lines.map(({ line }) => line), ...replies.map(({ outcome }) => JSON.stringify(outcome)));
            over = ask ? replies.length > 0 : lines.some(({ ticket }) => ticket !== null);
        }
    }
    return said;
}"""


def test_the_same_numbers(plain: Browser, studio_site: Site) -> None:
    steps = sequence()
    # With the features of the whole workspace, so that it is there already where the tests of Rust have been built.
    subprocess.run(["cargo", "build", "--quiet", "--workspace", "--example", "sequence"], cwd=ROOT, check=True)
    natively = subprocess.run(
        [PROGRAM.parent / "examples/sequence"], check=True, capture_output=True, text=True, input=json.dumps(steps)
    ).stdout
    lines = plain.open(studio_site.url).evaluate(IN_THE_BROWSER, steps)
    expected = OF_THE_CLOCK.sub("", natively).splitlines()
    assert len(expected) > 5 * 2000
    assert [OF_THE_CLOCK.sub("", line) for line in lines] == expected


def test_without_suspension(tmp_path: Path) -> None:
    """In Node, which does not suspend WebAssembly: assemble, download to a virtual module, step through."""
    done = subprocess.run(["node", HERE / "steps.mjs", FOLDER], check=True, capture_output=True, text=True)
    said = done.stdout.splitlines()
    assert said[0].startswith("TMCM-1140, firmware "), said
    assert said[1] == "loaded to addresses 0 to 3", said
    assert any("15" in line for line in said[2:]), said
    assert said[-3].startswith("page.tmc:1:8: error: unknown name 'Sped'"), said
