"""The page of recorded trials in a real headless browser."""

import json

import pytest
from page_server import served

from torc.trials.viewer_links import trial_key

pytestmark = pytest.mark.browser


def test_a_replay_pick_by_pick(recorded, open_page):
    with served(recorded) as client:
        page = open_page(client.url)
        page.locator("#says", has_text="Pick 1: object 1, removed").wait_for()
        page.locator("#panel", has_text="dg-select chose 1").wait_for()
        page.keyboard.press("ArrowRight")
        page.locator("#says", has_text="Pick 2: object 0, retrieved").wait_for()
        page.reload()
        page.locator("#says", has_text="Pick 2: object 0, retrieved").wait_for()
        page.keyboard.press("Home")
        page.locator("#says", has_text="Pick 1").wait_for()
        page.keyboard.press("d")
        assert page.locator("#graph-box g.node").count() == 3
        page.keyboard.press("o")
        assert page.locator("#objects tr[data-id]").count() == 2
        page.keyboard.press("c")
        page.locator("#scene-box canvas").wait_for()


def test_what_a_model_was_sent_is_shown(recorded, open_page):
    picks = recorded / "boxes" / "picks"
    (picks / "00_sent_1.png").write_bytes((picks / "00_seen.png").read_bytes())
    with served(recorded) as client:
        page = open_page(client.url)
        page.locator("summary", has_text="The picture that was sent").click()
        page.wait_for_function("document.querySelector('img.sent').naturalWidth === 640")


def test_a_report_leads_to_the_picks_of_its_trials_and_back(recorded, open_page):
    pytest.importorskip("matplotlib", reason="the extra 'report' is not installed")
    from torc.benchmark.report.writing import write_report

    write_report([recorded], recorded / "report")
    with served(recorded) as client:
        page = open_page(client.url)
        page.locator("#says", has_text="Pick 1").wait_for()
        page.click("#show-report")
        page.locator(".answer .it", has_text="dg-select").wait_for()
        page.locator("a.square").first.click()
        page.locator("#says", has_text="Pick 1: object 1, removed").wait_for()
        page.locator("#task", has_text="boxes").wait_for()
        page.keyboard.press("ArrowRight")
        page.locator("#says", has_text="Pick 2: object 0, retrieved").wait_for()
        page.go_back()
        page.locator("a.square").first.wait_for()


def test_a_report_opened_as_a_file_shows_how_to_see_a_trial(recorded, open_page):
    pytest.importorskip("matplotlib", reason="the extra 'report' is not installed")
    from torc.benchmark.report.writing import write_report

    page = open_page(write_report([recorded], recorded / "report").page.as_uri())
    page.locator("a.square").first.click()
    page.locator(".opening:visible", has_text=f"torc view {recorded / 'boxes'} --open").wait_for()
    page.locator(".opening:visible a").click()
    assert page.locator(".opening:visible").count() == 0


def test_text_from_strangers_stays_text(recorded, open_page):
    log = recorded / "boxes" / "events.jsonl"
    log.write_text(
        log.read_text().replace("it hides", "<img src=x onerror=document.title='owned'><b>bold</b>")
    )
    with served(recorded) as client:
        page = open_page(client.url)
        page.locator("#panel", has_text="<b>bold</b>").wait_for()
        assert page.locator("#panel img").count() == 0
        assert "owned" not in page.title()


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


def test_the_way_of_a_plan_is_drawn_when_it_comes(recorded, open_page):
    """Before the motions are confirmed: the trial is being played, and the 3-D view is open already."""
    playing = (recorded / "boxes").rename(recorded / "mine.partial")
    log = playing / "events.jsonl"
    (playing / "result.json").unlink()
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    before = [
        line
        for line in lines
        if line["event"] in ("started", "looked", "decided") and line.get("pick", 0) == 0
    ]
    plan = next(line for line in lines if line["event"] == "planned")
    way = [[0.6, -0.1, 1.3], [0.6, -0.1, 1.2], [0.62, -0.1, 1.1]]
    log.write_text("".join(json.dumps(line) + "\n" for line in before))
    with served(recorded, only="mine") as client:
        page = open_page(f"{client.url}/#{trial_key('mine')}")
        page.locator("#panel", has_text="dg-select chose 1").wait_for()
        page.keyboard.press("c")
        says = page.locator("#scene-box .tools span")
        page.locator("#scene-box .tools span", has_text="space and grasps").wait_for()
        assert "planned way" not in says.text_content()
        canvas = page.locator("#scene-box canvas")
        plain = canvas.screenshot()
        with log.open("a") as more:
            more.write(json.dumps({**plan, "ways": {"free": way[:2], "approach": way[1:]}}) + "\n")
        page.locator("#scene-box .tools span", has_text="planned way of the fingertips").wait_for()
        assert canvas.screenshot() != plain
