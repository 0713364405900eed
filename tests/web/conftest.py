"""Recorded trials without physics, a server over them, and a real headless browser."""

import re
import shutil
from pathlib import Path

import pytest
from page_server import served

from tests.helpers.fake_trial import play_fake_trial
from torc.pipeline.planners import make_planner
from torc.specs.trial import TrialSpec

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run"),
]
PATIENCE_MS = 60_000


@pytest.fixture(scope="session")
def _recorded(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("recorded") / "boxes"
    return play_fake_trial(TrialSpec.of("boxes", "dg-select"), out, make_planner("dg-select")).directory


@pytest.fixture
def recorded(_recorded, tmp_path) -> Path:
    """A directory with one recorded trial, `boxes`: pick 1, then the target; a test may change it."""
    shutil.copytree(_recorded, tmp_path / "trials" / "boxes")
    return tmp_path / "trials"


@pytest.fixture
def client(recorded):
    """The viewer of the recorded trial."""
    with served(recorded) as found:
        yield found


@pytest.fixture(scope="module")
def browser():
    """Debian's chromium, headless."""
    if CHROMIUM is None:
        pytest.skip("no chromium here; on Debian: apt-get install chromium")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as p:
        found = p.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield found
        found.close()


@pytest.fixture
def open_page(browser):
    """Opens pages; in the end none of them has asked anybody else for anything, or complained."""
    contexts, foreign, complaints = [], [], []

    def open_(url, **options):
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 720}, **options})
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        own = re.match(r"(http://|file:)[^/]*", url).group() + "/"
        page.on("request", lambda r: foreign.append(r.url) if not r.url.startswith((own, "blob:")) else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda m: complaints.append(m.text) if "Content Security" in m.text else None)
        page.goto(url)
        return page

    yield open_
    for context in contexts:
        context.close()
    assert foreign == []
    assert complaints == []
