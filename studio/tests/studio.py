"""The page as its users meet it: by roles and names."""

from __future__ import annotations

import base64
import json
import os
import re
import subprocess
import zlib
from pathlib import Path
from typing import Any

from bed.module import PROGRAM, ROOT
from playwright.sync_api import Locator, Page, expect

# Where `cargo studio --build` has made the page; or another copy of it.
FOLDER = Path(os.environ.get("TMCL_STUDIO", ROOT / "target" / "studio"))

# A short session, written by hand.
SMALL: dict[str, Any] = {
    "session": 1,
    "title": "A turn, and a hand",
    "made": None,
    "start": {"product": "1140", "world": "[stage]\nleft = -51200\n", "eeprom": None},
    "texts": [{"name": "program.tmc", "text": "// of the session\nSTOP\n"}],
    "curves": ["GAP 1, 0", "rotor"],
    "done": ["50000 MVP REL, 0, 12800", "60000 GAP 1, 0", "700000 press left"],
    "until": 900_000,
}


class Studio:
    """An open page."""

    def __init__(self, page: Page):
        self.page = page
        self.module = page.get_by_role("status", name="Module")
        self.link = page.get_by_role("status", name="Link")
        self.line = page.get_by_role("textbox", name="Command")
        self.around = page.get_by_role("textbox", name="Line of the control port")
        self.replies = page.get_by_role("log", name="Replies").get_by_role("listitem")
        self.answers = page.get_by_role("log", name="Answers").get_by_role("listitem")
        self.danger = page.get_by_role("alert")
        expect(self.link).to_have_text("ready")

    def button(self, name: str) -> Locator:
        """A button by its whole name."""
        return self.page.get_by_role("button", name=name, exact=True)

    def start(self, product: str = "1140") -> None:
        """Starts a virtual module."""
        self.page.get_by_label("Virtual module", exact=True).select_option(product)
        self.button("Start").click()
        self.is_there(product)

    def connect(self, product: str = "1140") -> None:
        """Connects the serial port."""
        self.button("Connect").click()
        self.is_there(product)

    def is_there(self, product: str) -> None:
        """Waits until a module has told what it is."""
        expect(self.link).to_have_text("connected")
        expect(self.module).to_contain_text(f"TMCM-{product}, firmware ")

    def is_read(self) -> None:
        """Waits until the module's parameters have been read, which is a job of its own behind each connection."""
        told = self.page.get_by_role("status", name="State of the parameters")
        expect(told).to_have_text(re.compile("^read(,.*)?$"))

    def send(self, line: str) -> str:
        """Sends a command, and gives its reply."""
        count = self.replies.count()
        self.line.fill(line)
        self.line.press("Enter")
        expect(self.replies).to_have_count(count + 1)
        return self.replies.nth(count).inner_text()

    def control(self, line: str) -> dict[str, Any]:
        """Gives the virtual module a line of its control port, and gives the fields of the answer."""
        count = self.answers.count()
        self.around.fill(line)
        self.around.press("Enter")
        expect(self.answers).to_have_count(count + 1)
        # The line stands above its answer.
        answer: dict[str, Any] = json.loads(self.answers.nth(count).inner_text().splitlines()[-1])
        return answer

    def program(self, text: str) -> None:
        """Puts a text into the editor."""
        self.page.get_by_role("textbox", name="Program", exact=True).fill(text)

    def load(self, text: str) -> None:
        """Loads a program, also over another one, about which the page asks first."""
        self.program(text)
        count = self.job("Load program").count()
        self.button("Load program").click()
        answer = self.page.get_by_role("dialog").get_by_role("button", name="Load", exact=True)
        begun = self.job("Load program").nth(count)
        expect(answer.or_(begun)).to_be_visible()
        if answer.is_visible():
            answer.click()
        expect(begun).to_contain_text("done")
        expect(self.page.get_by_role("status", name="Debugger")).to_contain_text("halted")

    def row(self, table: str, name: str) -> Locator:
        """The cell of the row with this name."""
        rows = self.page.get_by_role("table", name=table).get_by_role("row")
        return rows.filter(has=self.page.get_by_role("rowheader", name=name, exact=True)).get_by_role("cell")

    def job(self, name: str) -> Locator:
        """The lines of the jobs of this name."""
        return self.page.get_by_role("list", name="Jobs").get_by_role("listitem").filter(has_text=name)


def tmcl(*arguments: str, code: int = 0, given: Path | None = None) -> str:
    """What the program `tmcl` prints, without the end of the line."""
    text = given.read_text() if given else None
    done = subprocess.run([PROGRAM, *arguments], check=False, capture_output=True, text=True, input=text)
    assert done.returncode == code, done.stderr
    return done.stdout.rstrip("\n")


def link(session: object) -> str:
    """What stands behind the address of the page for a session, or for any text."""
    text = session if isinstance(session, str) else json.dumps(session)
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    packed = packer.compress(text.encode()) + packer.flush()
    return "#session=" + base64.urlsafe_b64encode(packed).decode().rstrip("=")
