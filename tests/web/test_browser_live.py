"""The page of `torc run --live` in a real headless browser."""

import pytest
from page_server import served

from torc.episode.viewer_links import trial_key

pytestmark = pytest.mark.browser


def test_a_trial_that_is_being_played_is_followed(recorded, open_page):
    playing = (recorded / "boxes").rename(recorded / "mine.partial")
    log, result = playing / "events.jsonl", playing / "result.json"
    lines, ended = log.read_text().splitlines(keepends=True), result.read_text()
    first = [line for line in lines if '"pick": 1' not in line and '"event": "ended"' not in line]
    log.write_text("".join(first))
    result.unlink()
    with served(recorded, only="mine") as client:
        page = open_page(f"{client.url}/#{trial_key('mine')}")
        page.locator("#says", has_text="Pick 1: object 1, removed").wait_for()
        log.write_text("".join(lines))
        result.write_text(ended)
        playing.rename(recorded / "mine")
        page.locator("#says", has_text="Pick 2: object 0, retrieved").wait_for()
