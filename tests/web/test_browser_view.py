"""The page of recorded trials in a real headless browser."""

import io
import shutil

import numpy as np
import pytest
from page_server import served
from PIL import Image, ImageColor
from scipy.ndimage import uniform_filter

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


def _trials(recorded, count):
    """Copies of the recorded trial, by the names trial-0, trial-1, ..."""
    for i in range(count):
        shutil.copytree(recorded / "boxes", recorded / f"trial-{i}")


def test_a_phone_opens_a_trial_at_its_top(recorded, open_page):
    with served(recorded) as client:
        page = open_page(client.url)
        page.set_viewport_size({"width": 390, "height": 844})
        key = client.get("/api/trials").json["trials"][0]["key"]
        page.goto(f"{client.url}/#{key}/1")
        page.reload()
        page.locator("#strip [aria-current]", has_text="2. object 0").wait_for()
        page.wait_for_load_state("networkidle")
        assert page.evaluate("scrollY") == 0
        assert page.evaluate("document.documentElement.scrollHeight") > 900  # there is something to scroll to


def test_the_list_of_trials_is_filtered(recorded, open_page):
    _trials(recorded, 12)
    with served(recorded) as client:
        page = open_page(client.url)
        page.locator("#says", has_text="Pick 1").wait_for()
        page.click("#show-trials")
        page.locator("#trials [role=status]", has_text="13 trials").wait_for()
        assert page.locator("#trials li:visible").count() == 13
        page.fill("#filter", "RETRIEVED trial-1")
        assert page.locator("#trials li:visible").count() == 3  # 1, 10, 11
        page.locator("#trials [role=status]", has_text="3 of 13 trials").wait_for()
        page.fill("#filter", "no such trial")
        assert page.locator("#trials li:visible").count() == 0
        page.fill("#filter", "trial-11")
        page.locator("#trials li:visible button").click()
        page.locator("#says", has_text="Pick 1").wait_for()
        assert page.locator("#trials").is_hidden()


def test_a_report_leads_to_the_picks_of_its_trials_and_back(recorded, open_page):
    pytest.importorskip("matplotlib", reason="the extra 'report' is not installed")
    from torc.benchmark.report.writing import write_report

    write_report([recorded], recorded / "report")
    with served(recorded) as client:
        page = open_page(client.url)
        page.locator("#says", has_text="Pick 1").wait_for()
        page.click("#show-report")
        page.locator(".answer .it", has_text="dg-select").wait_for()
        page.click(".board a")
        page.locator("#says", has_text="Pick 1: object 1, removed").wait_for()
        page.locator("#task", has_text="boxes").wait_for()
        page.keyboard.press("ArrowRight")
        page.locator("#says", has_text="Pick 2: object 0, retrieved").wait_for()
        page.go_back()
        page.locator(".board a").wait_for()


def test_an_address_is_followed_in_an_open_page_and_explained_if_it_is_of_elsewhere(recorded, open_page):
    with served(recorded) as client:
        page = open_page(f"{client.url}/#0123456789ab/0")
        page.locator("#panel", has_text="There is no such trial here").wait_for()
        key = client.get("/api/trials").json["trials"][0]["key"]
        for pick, told in ((1, "Pick 2: object 0"), (0, "Pick 1: object 1")):
            page.evaluate(f"location.hash = '#{key}/{pick}'")
            page.locator("#says", has_text=told).wait_for()


def _open_scene(page):
    page.locator("#says", has_text="Pick 1").wait_for()
    page.keyboard.press("c")
    page.locator("#scene-box", has_text="object 1").wait_for()
    return page.locator("#scene-box canvas")


def _drawn(canvas):
    """The pixels of the 3-D view."""
    canvas.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return np.asarray(Image.open(io.BytesIO(canvas.screenshot())).convert("RGB"))


def test_the_scene_is_drawn_and_turns_and_survives_a_lost_context(recorded, open_page):
    with served(recorded) as client:
        page = open_page(client.url)
        canvas = _open_scene(page)
        canvas.focus()
        before = _drawn(canvas)
        assert len(np.unique(before.reshape(-1, 3), axis=0)) > 10
        page.keyboard.press("ArrowLeft")
        turned = _drawn(canvas)
        assert (turned != before).any()
        canvas.evaluate("""async (canvas) => {
            const context = canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
            const heard = (kind) => new Promise((done) => canvas.addEventListener(kind, done));
            const [lost, restored] = [heard("webglcontextlost"), heard("webglcontextrestored")];
            context.loseContext();
            await lost;
            setTimeout(() => context.restoreContext());
            await restored;
        }""")
        assert (_drawn(canvas) == turned).mean() > 0.99


def test_a_click_into_the_scene_selects_the_object_there(recorded, open_page):
    with served(recorded) as client:
        page = open_page(client.url)
        canvas = _open_scene(page)
        page.locator("#scene-box label", has_text="object colours").click()
        page.locator("#scene-box button", has_text="Camera").click()
        key = client.get("/api/trials").json["trials"][0]["key"]
        for seen in client.get(f"/api/trials/{key}/picks/0").json["objects"]:
            same = (_drawn(canvas) == ImageColor.getrgb(seen["color"])).all(axis=2)
            middle = uniform_filter(same.astype(float), 21)
            row, col = np.unravel_index(middle.argmax(), middle.shape)
            canvas.click(position={"x": int(col), "y": int(row)})
            page.locator("#scene-box", has_text=f"object {seen['id']} ").wait_for()


def test_without_webgl_the_page_says_so(recorded, open_page):
    with served(recorded) as client:
        page = open_page(client.url)
        page.locator("#says", has_text="Pick 1").wait_for()
        page.evaluate("""() => {
            const get = HTMLCanvasElement.prototype.getContext;
            HTMLCanvasElement.prototype.getContext = function (kind, ...options) {
                return kind.startsWith("webgl") ? null : get.call(this, kind, ...options);
            };
        }""")
        page.keyboard.press("c")
        page.locator("#panel", has_text="This browser has no WebGL").wait_for()
        page.keyboard.press("o")
        assert page.locator("#objects tr[data-id]").count() == 2


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


def test_a_trial_that_cannot_be_read_is_explained(recorded, open_page):
    (recorded / "boxes" / "events.jsonl").write_text("nonsense\n")
    with served(recorded) as client:
        page = open_page(client.url)
        page.locator("#panel", has_text="line 1").wait_for()
