"""What the page may not do, by its own policy: it is served without any header."""

from __future__ import annotations

from bed.browser import Browser
from bed.server import Elsewhere, Site
from studio import Studio

# Tries both, and tells what has become of it.
TRY = """url => new Promise(resolve => setTimeout(async () => {
    // Called by the page itself, not by the debugger, which the policy does not hold back.
    const outcome = {};
    try { outcome.eval = eval("1 + 1"); } catch (error) { outcome.eval = error.name; }
    try { outcome.made = new Function("return 2")(); } catch (error) { outcome.made = error.name; }
    try {
        await fetch(url, { mode: "no-cors" });
        outcome.fetch = "went out";
    } catch (error) {
        outcome.fetch = error.name;
    }
    resolve(outcome);
}))"""
REFUSED = {"eval": "EvalError", "made": "EvalError", "fetch": "TypeError"}


def test_page_and_workers_run_and_reach_nothing_else(
    plain_chromium: Browser, studio_site: Site, elsewhere: Elsewhere
) -> None:
    plain_chromium.allow("Content Security Policy")
    plain_chromium.allow("Refused to connect")
    studio = Studio(plain_chromium.open(studio_site.url))
    studio.start()
    assert len(studio.page.workers) == 3
    assert studio.page.evaluate(TRY, elsewhere.url) == REFUSED
    for worker in studio.page.workers:
        assert worker.evaluate(TRY, elsewhere.url) == REFUSED
    assert elsewhere.requests == []


def test_nothing_is_asked_of_anybody_else(plain_chromium: Browser, studio_site: Site) -> None:
    studio = Studio(plain_chromium.open(studio_site.url))
    asked: list[str] = []
    studio.page.on("request", lambda request: asked.append(request.url))
    studio.start()
    studio.send("GAP 1, 0")
    assert all(url.startswith((studio_site.origin, "blob:")) for url in asked), asked
