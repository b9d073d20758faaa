"""Flash images in the page: the very firmware on the emulated microcontroller, with its log."""

from __future__ import annotations

import re
import struct
import subprocess
from pathlib import Path

import pytest
from bed.browser import Browser
from bed.module import ROOT
from bed.server import Site
from playwright.sync_api import Locator, expect
from studio import Studio


@pytest.fixture(scope="session")
def image() -> Path:
    """The image of the TMCM-1140, which is built if it is not there yet."""
    return built("tmcm1140")


def built(name: str) -> Path:
    """An image, which is built if it is not there yet."""
    done = subprocess.run(["cargo", "fw", name], cwd=ROOT, check=True, capture_output=True, text=True)
    path = ROOT / "target" / "thumbv7em-none-eabi" / "release" / name
    assert path.exists(), done.stdout
    return path


def told(studio: Studio) -> Locator:
    """What there is to say about the image."""
    return studio.page.get_by_role("status", name="Flash image")


def open_file(studio: Studio, path: Path) -> None:
    """Opens a file as a flash image."""
    with studio.page.expect_file_chooser() as chooser:
        studio.button("Open flash image").click()
    chooser.value.set_files(path)


def stopping() -> bytes:
    """A program that counts down for a while, and reads a random number then, of which the emulator knows nothing."""
    code = (0x4802, 0x3801, 0xD1FD, 0x4902, 0x680A, 0xE7FE)  # ldr r0; subs r0, #1; bne; ldr r1; ldr r2, [r1]; b
    flash = struct.pack("<II6HII", 0x2002_0000, 0x0800_0009, *code, 12_000_000, 0x5006_0808)
    head = b"\x7fELF\x01\x01\x01".ljust(16, b"\0") + struct.pack("<HHIIIII", 2, 40, 1, 0x0800_0009, 52, 0, 0)
    head += struct.pack("<6H", 52, 32, 1, 40, 0, 0)
    return head + struct.pack("<8I", 1, 84, 0x0800_0000, 0x0800_0000, len(flash), len(flash), 5, 4) + flash


def test_an_image_runs_with_its_log(studio: Studio, image: Path) -> None:
    asked: list[str] = []
    studio.page.on("request", lambda request: asked.append(request.url))
    studio.start("6110")
    assert not any("tmcl_studio_image" in url for url in asked), "only when it is asked for"
    open_file(studio, image)
    # The image tells for which product it is.
    studio.is_there("1140")
    expect(told(studio)).to_contain_text("runs on the emulated microcontroller of a TMCM-1140")
    log = studio.page.get_by_role("log", name="Log of the image").get_by_role("listitem")
    expect(log.first).to_contain_text("power on")
    assert studio.send("ROR 0, 500").endswith("status 100 ok")
    expect(studio.row("Axes", "actual speed (int)")).to_have_text("500")
    expect(studio.page.get_by_role("status", name="Virtual time")).to_have_text(
        re.compile(r" s, (goes|slow: it goes at \d\.\d+ of the clock)")
    )
    studio.control("speed 1000")
    expect(studio.page.get_by_role("status", name="Virtual time")).to_contain_text("slow: it goes at ")
    studio.control("speed 1")
    # A hand at its stage.
    studio.control("press left")
    assert studio.send("GAP 11, 0").startswith("GAP 11, 0: 1 ")
    # A session is of the firmware's core.
    expect(studio.button("Save session")).to_be_disabled()
    studio.control("restart")
    expect(log.filter(has_text="power on")).to_have_count(2)
    studio.start("1140")
    expect(studio.page.get_by_role("log", name="Log of the image")).to_be_hidden()
    expect(studio.button("Save session")).to_be_enabled()


def test_what_is_no_image_is_told(plain_chromium: Browser, studio_site: Site, image: Path, tmp_path: Path) -> None:
    studio = Studio(plain_chromium.open(studio_site.url))
    elf = image.read_bytes()
    cut, text = tmp_path / "cut", tmp_path / "text"
    cut.write_bytes(elf[: len(elf) // 2])
    text.write_text("no image")
    for file in (cut, text, ROOT / "target" / "debug" / "tmcl"):
        open_file(studio, file)
        expect(told(studio)).to_contain_text("the image cannot be used: ")
        expect(told(studio)).to_contain_text("A flash image is the file that `cargo fw` builds")
    open_file(studio, built("tmcm1140-canopen"))
    expect(told(studio)).to_contain_text("this is the image of the CANopen firmware of the TMCM-1140")
    # One that stops after a while, and the page goes on.
    stops = tmp_path / "stops"
    stops.write_bytes(stopping())
    open_file(studio, stops)
    expect(studio.link).to_contain_text("the module cannot go on: ")
    expect(told(studio)).to_contain_text("it has stopped: ")
    expect(studio.module).to_have_text("no module")
    studio.start()
    assert studio.send("GAP 1, 0").endswith("status 100 ok")
