"""Prints how fast the page is: time until it is ready, what a frame of the scope takes, and memory.

    PATH=$PWD/target/studio-venv/bin:$PATH python studio/tests/measure.py

No test asserts these numbers: they are those of this computer. `test_a_hundred_stops` prints what STOP takes while the
link is full.
"""

from __future__ import annotations

import shutil
import statistics
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from bed.namespace import installed
from bed.server import Site
from playwright.sync_api import Page, sync_playwright
from studio import FOLDER, Studio

# A scope of eight curves at 1 kHz, filled with ten minutes, whose frames are timed.
SCOPE = """<!doctype html><link rel="icon" href="data:,"><link rel="stylesheet" href="style.css">
<link rel="stylesheet" href="scope/scope.css"><section></section><script type="module">
import { ScopePanel } from './scope/panel.js';
const panel = new ScopePanel(document.querySelector('section'), { download() {}, announce() {} });
const curves = Array.from({ length: 8 }, (_, curve) => curve);
panel.columns(curves.map(curve => ({ name: `curve ${curve}`, unit: 'int', decimals: 0, note: '' })));
let at = 0;
window.feed = count => {
    for (let left = count; left > 0; left -= 1000) {
        panel.rows(Array.from({ length: Math.min(left, 1000) }, () => {
            at += 1;
            return { at, values: curves.map(curve => Math.round(1000 * Math.sin(at / (50 * (curve + 1))))) };
        }));
    }
};
window.panel = panel;
const frame = () => new Promise(resolve => requestAnimationFrame(resolve));
window.time = async count => {
    const times = [];
    for (let left = count; left > 0; left -= 1) {
        feed(16);
        const begun = performance.now();
        await frame();
        times.push(performance.now() - begun);
    }
    return times;
};
</script>"""


def ready(page: Page, url: str) -> float:
    """The time until a virtual module is there, in milliseconds."""
    page.goto(url)
    studio = Studio(page)
    loaded: float = page.evaluate("performance.now()")
    studio.start()
    return loaded


def main() -> None:
    """Prints the table."""
    with sync_playwright() as playwright, Site(FOLDER) as site, tempfile.TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=installed("chromium"), args=["--no-sandbox"])
        times = [ready(browser.new_page(), site.url) for _ in range(5)]
        print(f"| ready | {statistics.median(times):.0f} ms |")
        shutil.copytree(FOLDER, folder, dirs_exist_ok=True)
        (Path(folder) / "scope.html").write_text(SCOPE)
        with Site(Path(folder)) as own:
            page = browser.new_page(viewport={"width": 1400, "height": 900})
            page.goto(own.url + "scope.html")
            page.evaluate("feed(600_000)")
            for window in ("1 s", "10 s", "1 min", "10 min"):
                page.get_by_label("Window").select_option(label=window)
                frames = sorted(page.evaluate("time(60)"))
                figures = page.evaluate("panel.figures()")
                looked = figures["looked"] / figures["columns"] / figures["curves"]
                typical, worst = frames[30], frames[-1]
                print(f"| frame, {window} | {typical:.1f} ms, worst {worst:.1f} ms, {looked:.1f} values a column |")
            print(f"| buffers | {page.evaluate('panel.figures().bytes') / 1e6:.1f} MB |")
        browser.close()


if __name__ == "__main__":
    main()
