"""The picture, its marks and its words in a real headless browser, on a desktop and on a phone."""

import pytest
from page_server import Game, served

from tests.helpers.fake_trial import SHAPES
from torc.testing.synthetic import SyntheticBox
from torc.trials.recorded import read_trial
from torc.web.pick_page import find_tags
from torc.web.session import Phase

pytestmark = pytest.mark.browser

PHONE = {
    "viewport": {"width": 390, "height": 844},
    "device_scale_factor": 2,
    "has_touch": True,
    "is_mobile": True,
}
SMALL = SyntheticBox(3, (0.60, -0.42, 1.065), (0.025, 0.025, 0.03))
MARKED = """() => {
  const c = document.querySelector('#overlay');
  return c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v > 0);
}"""


@pytest.fixture
def game(tmp_path):
    return Game(tmp_path / "human", shapes=(*SHAPES, SMALL))


def _choosing(client, open_page, **options):
    page = open_page(client.url, **options)
    page.click("#start")
    page.locator("#pick").wait_for()
    page.wait_for_function(MARKED)
    return page


def _scale(page):
    return page.evaluate("new DOMMatrix(getComputedStyle(document.getElementById('seen')).transform).a")


def _on_screen(page, x, y):
    """Where a pixel of the picture is in the window."""
    script = """([x, y]) => {
      const matrix = new DOMMatrix(getComputedStyle(document.getElementById('seen')).transform);
      const { left, top } = document.getElementById('overlay').getBoundingClientRect();
      const at = matrix.transformPoint(new DOMPoint(x, y));
      return [left + at.x, top + at.y];
    }"""
    return page.evaluate(script, [x, y])


def test_a_tag_beside_its_object_selects_it(game, open_page):
    with game.served() as client:
        page = _choosing(client, open_page)
        (directory,) = game.root.glob("*.partial")
        label = read_trial(directory).view(0).label_image
        tag = find_tags(label, [1, 2, 3], outlines=True)[3]
        left, top, width, height = tag["box"]
        assert tag["leader"]
        assert not (label[top : top + height, left : left + width] == 3).any()
        at = _on_screen(page, left + width / 2, top + height / 2)
        page.mouse.click(*at)
        page.locator("#pick", has_text="Pick 3").wait_for()


def test_marks_go_while_a_key_or_the_button_is_held(game, open_page):
    with game.served() as client:
        page = _choosing(client, open_page)
        assert page.get_attribute("#seen", "src").endswith("/plain.png")
        page.keyboard.press("1")
        for down, up in (
            (lambda: page.keyboard.down("h"), lambda: page.keyboard.up("h")),
            (lambda: (page.hover("#plain"), page.mouse.down()), page.mouse.up),
        ):
            down()
            assert not page.evaluate(MARKED)
            up()
            assert page.evaluate(MARKED)


def test_the_picture_begins_at_the_objects_and_zooms_to_twelve_times(game, open_page):
    with game.served() as client:
        page = _choosing(client, open_page)
        close = _scale(page)
        page.keyboard.press("z")
        whole = _scale(page)
        assert close > 1.2 * whole
        page.hover("#overlay")
        for _ in range(20):
            page.mouse.wheel(0, -400)
        page.wait_for_function(
            "(s) => new DOMMatrix(getComputedStyle(document.getElementById('seen')).transform).a > s",
            arg=11.9 * whole,
        )
        assert _scale(page) == pytest.approx(12 * whole, rel=1e-3)
        page.keyboard.press("z")
        assert _scale(page) == pytest.approx(close, rel=1e-3)


def test_note_and_selection_outlive_a_look_back_and_a_reload(game, open_page):
    with game.served() as client:
        page = _choosing(client, open_page)
        page.keyboard.press("1")
        page.fill("#note", "it hides the most")
        page.click("#pick")
        page.locator("#count", has_text="Pick 2 of 15").wait_for()
        page.locator("#pick").wait_for()
        assert page.input_value("#note") == ""
        page.keyboard.press("2")
        page.fill("#note", "and this one")
        page.locator("#strip button.pick").first.click()
        page.locator("#action", has_text="Looking back").wait_for()
        page.get_by_role("button", name="Back to now").click()
        page.locator("#pick", has_text="Pick 2").wait_for()
        assert page.input_value("#note") == "and this one"
        page.reload()
        page.locator("#pick", has_text="Pick 2").wait_for()
        assert page.input_value("#note") == "and this one"


def test_a_phone_shows_start_and_end_in_full_and_a_table_that_scrolls_in_itself(game, open_page):
    with game.served() as client:
        page = open_page(client.url, **PHONE)
        box = page.locator("#start").bounding_box()
        assert page.evaluate("scrollY") == 0
        assert box["y"] + box["height"] < PHONE["viewport"]["height"]
        page.tap("#start")
        page.locator("#pick").wait_for()
        page.wait_for_function(MARKED)
        (directory,) = game.root.glob("*.partial")
        left, top, width, height = find_tags(
            read_trial(directory).view(0).label_image, [1, 2, 3], outlines=True
        )[1]["box"]
        page.touchscreen.tap(*_on_screen(page, left + width / 2, top + height / 2))
        page.locator("#pick", has_text="Pick 1").wait_for()
        assert page.locator("#panel").bounding_box()["height"] < 0.6 * PHONE["viewport"]["height"]
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["viewport"]["width"]
        page.get_by_role("button", name="Give up").tap()
        page.locator("#confirm").get_by_role("button", name="Give up").tap()
        page.locator("#ended").wait_for()
        card = page.locator("#card").bounding_box()
        assert page.locator("#card").evaluate("(c) => c.scrollHeight <= c.clientHeight + 1")
        assert card["y"] < 200


def test_every_finished_trial_has_a_replay_link(tmp_path, open_page):
    game = Game(tmp_path / "human", problems=("one", "two"))
    with game.served() as client:
        page = open_page(client.url)
        for _ in range(2):
            page.click("#start")
            game.wait(Phase.CHOOSING)
            page.get_by_role("button", name="Give up").click()
            page.locator("#confirm").get_by_role("button", name="Give up").click()
            page.locator("#ended").wait_for()
            if game.session.state.phase is not Phase.DONE:
                page.locator("#card li a").wait_for()
        game.wait(Phase.DONE)
        page.locator("#card li a").nth(1).wait_for()
        links = page.locator("#card li a").evaluate_all("(all) => all.map((a) => a.getAttribute('href'))")
        assert len(set(links)) == 2


def test_the_graph_begins_with_what_the_target_waits_for(recorded, open_page):
    with served(recorded) as client:
        page = open_page(client.url)
        page.locator("#says", has_text="Pick 1").wait_for()
        page.keyboard.press("d")
        page.locator("#target-waits", has_text="The target waits: it may be hidden by 1").wait_for()
        page.keyboard.press("ArrowRight")
        page.locator("#target-waits", has_text="Nothing has to go before the target").wait_for()
        assert page.locator("#graph-box g.node").count() == 1
        page.check("#whole-graph")
        assert page.locator("#graph-box g.node").count() == 2


def test_an_older_recording_shows_its_marked_picture(recorded, open_page):
    for plain in recorded.rglob("*_plain.png"):
        plain.unlink()
    with served(recorded) as client:
        page = open_page(client.url)
        page.locator("#says", has_text="Pick 1").wait_for()
        assert page.get_attribute("#seen", "src").endswith("/seen.png")
        assert page.locator("#plain").is_disabled()


def test_the_ring_of_an_object_leaves_its_neighbours_alone(recorded, open_page):
    script = """async () => {
      const { drawMarks, rims } = await import("/page/marks.js");
      const [width, height] = [40, 20];
      const data = Int8Array.from({ length: width * height }, (_, i) => {
        const x = i % width, y = Math.floor(i / width);
        if (y < 5 || y >= 15) return -1;
        return x >= 5 && x < 20 ? 1 : x >= 20 && x < 35 ? 2 : -1;
      });
      const canvas = new OffscreenCanvas(4 * width, 4 * height);
      const context = canvas.getContext("2d");
      const all = rims({ data, shape: [height, width] });
      const what = { objects: [{ id: 1 }, { id: 2 }], rims: all, own: false, selected: 1, hovered: null };
      drawMarks(context, { scale: 4, x: 0, y: 0 }, what);
      const inked = (left, right) => {
        const { data: rgba } = context.getImageData(4 * left, 4 * 6, 4 * (right - left), 4 * 8);
        return rgba.some((v) => v > 0);
      };
      return { neighbour: inked(21, 34), own: inked(5, 20), beside: inked(2, 5) };
    }"""
    with served(recorded) as client:
        page = open_page(client.url)
        assert page.evaluate(script) == {"neighbour": False, "own": True, "beside": True}


def test_numbers_are_said_as_they_are_meant(recorded, open_page):
    script = """async () => {
      const { percent } = await import("/page/dom.js");
      const { blocked, litres, litresNumber, valid } = await import("/page/words.js");
      const blockers = [{ id: 6, grasps: 7 }, { id: 2, grasps: 3 }];
      const o = { valid: 25, score: 0.99, blocked: 9, likely_if_free: 6, blockers };
      const page = { likely: 0.25 };
      return [
        percent(0.999), percent(1), percent(0.001), percent(0.994),
        litres(0.004), litres(0.03), litres(1.26), litres(0), litresNumber(0.004),
        valid(o), blocked(o, page), blocked(o, page, 1), blocked({ ...o, likely_if_free: null }, page),
      ];
    }"""
    with served(recorded) as client:
        said = [text.replace("\u00a0", " ") for text in open_page(client.url).evaluate(script)]
    assert said == [
        *(">99 %", "100 %", "<1 %", "99 %"),
        *("hides hardly any space", "hides 0.03 litres", "hides 1.3 litres", "", "<0.01"),
        "25 valid grasps, the best is 99 % likely to succeed",
        "9 blocked (6 of them at least 25 % likely to succeed once free): 6 blocks 7, 2 blocks 3",
        "9 blocked, 6 likely once free: 6 blocks 7 and 1 more",
        "9 blocked: 6 blocks 7, 2 blocks 3",
    ]
