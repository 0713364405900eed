"""The expert's page in a real headless browser, with fakes for the robot."""

import pytest
from page_server import Game

from torc.episode.recorded import read_trial
from torc.perception.label_places import mask_anchor
from torc.web.session import Phase

pytestmark = pytest.mark.browser


@pytest.fixture
def game(tmp_path):
    return Game(tmp_path / "human")


def _click(page, game, object_id):
    """Click on a pixel of the object in the image."""
    (directory,) = game.root.glob("*.partial")
    label = read_trial(directory).view(game.session.state.pick).label_image
    row, col = mask_anchor(label == object_id)
    box = page.locator("#overlay").bounding_box()
    height, width = label.shape
    scale = min(box["width"] / width, box["height"] / height)
    x = box["x"] + (box["width"] - width * scale) / 2 + (col + 0.5) * scale
    y = box["y"] + (box["height"] - height * scale) / 2 + (row + 0.5) * scale
    page.mouse.move(x, y)
    page.locator(f"#pointed:has-text('Object {object_id}'), #pointed:has-text('the target')").wait_for()
    page.mouse.click(x, y)


def _chosen(game):
    (directory,) = (p for p in game.root.iterdir() if p.name != "none")
    return [p.decided.object_id for p in read_trial(directory).picks if p.decided]


def _ready_to_pick(page, number):
    page.locator("#count", has_text=f"Pick {number} ").wait_for()
    page.locator("#pick").wait_for()


def test_a_whole_episode_by_clicks(game, open_page):
    with game.served() as client:
        page = open_page(client.url)
        page.click("#start")
        _ready_to_pick(page, 1)
        assert page.locator("#pick").is_disabled()
        _click(page, game, 1)
        page.fill("#note", "it hides the most")
        page.click("#pick")
        _ready_to_pick(page, 2)
        page.locator("#strip", has_text="removed").wait_for()
        _click(page, game, 0)
        page.click("#pick")
        page.locator("#ended", has_text="retrieved in 2 picks").wait_for()
    assert _chosen(game) == [1, 0]
    (directory,) = game.root.iterdir()
    assert read_trial(directory).picks[0].decided.reason == "it hides the most"


def test_a_whole_episode_by_keys(game, open_page):
    with game.served() as client:
        page = open_page(client.url)
        page.locator("#start:focus").wait_for()
        page.keyboard.press("Enter")
        _ready_to_pick(page, 1)
        page.keyboard.press("Enter")  # nothing is selected yet
        for key, chosen in (("ArrowDown", "1"), ("ArrowDown", "2"), ("ArrowUp", "1"), ("2", "2"), ("1", "1")):
            page.keyboard.press(key)
            page.locator("#pick", has_text=f"Pick {chosen}").wait_for()
        page.keyboard.press("?")
        page.locator("#help[open]").wait_for()
        page.keyboard.press("Escape")
        page.locator("#help:not([open])").wait_for(state="attached")
        page.keyboard.press("Enter")
        _ready_to_pick(page, 2)
        page.keyboard.press("0")
        page.locator("#pick", has_text="Pick 0").wait_for()
        page.keyboard.press("Enter")
        page.locator("#ended", has_text="retrieved").wait_for()
    assert _chosen(game) == [1, 0]


def test_an_object_that_cannot_be_grasped_cannot_be_picked(tmp_path, open_page):
    from torc.testing.synthetic import SyntheticBox

    flat = SyntheticBox(3, (0.62, 0.05, 1.055), (0.16, 0.16, 0.01))
    small = SyntheticBox(2, (0.62, -0.30, 1.10), (0.05, 0.05, 0.10))
    game = Game(tmp_path / "human", shapes=(flat, small))
    with game.served() as client:
        page = open_page(client.url)
        page.click("#start")
        _ready_to_pick(page, 1)
        _click(page, game, 3)
        page.locator("#action", has_text="not graspable: ").wait_for()
        assert page.locator("#pick").is_disabled()
        page.keyboard.press("Enter")
        assert game.session.state.phase is Phase.CHOOSING


def test_a_reload_in_the_middle_loses_nothing(game, open_page):
    game.may_move.clear()
    with game.served() as client:
        page = open_page(client.url)
        page.click("#start")
        _ready_to_pick(page, 1)
        page.reload()
        _ready_to_pick(page, 1)
        page.keyboard.press("1")
        page.click("#pick")
        page.locator("#says", has_text="The robot picks object 1").wait_for()
        page.reload()
        page.locator("#says", has_text="The robot picks object 1").wait_for()
        page.locator("#count", has_text="Pick 1 ").wait_for()
        game.may_move.set()
        _ready_to_pick(page, 2)
        page.reload()
        page.locator("#strip", has_text="removed").wait_for()
        _ready_to_pick(page, 2)


def test_of_two_browsers_one_chooses_and_the_other_follows(game, open_page):
    game.may_move.clear()
    with game.served() as client:
        one, two = open_page(client.url), open_page(client.url)
        one.click("#start")
        for page in (one, two):
            _ready_to_pick(page, 1)
        two.keyboard.press("2")
        one.keyboard.press("1")
        one.click("#pick")
        one.locator("#says", has_text="The robot picks object 1").wait_for()
        key = game.session.state.trial
        late = client.post("/api/session/choose", {"trial": key, "pick": 0, "object_id": 2})
        assert late.json["error"] == "Pick 1 has been decided already: object 1."
        two.locator("#says", has_text="The robot picks object 1").wait_for()
        assert two.locator("#pick").count() == 0
        game.may_move.set()
        for page in (one, two):
            _ready_to_pick(page, 2)


def test_a_lost_connection_is_said_and_mends_itself(game, open_page):
    with game.served() as client:
        port = client.port
        page = open_page(client.url)
        page.click("#start")
        _ready_to_pick(page, 1)
        page.keyboard.press("1")
    page.locator("#connection", has_text="Connection lost").wait_for()
    page.click("#pick")
    page.locator("#action [role=alert]").wait_for()
    with game.served(port):
        page.locator("#connection").wait_for(state="hidden")
        page.click("#pick")
        _ready_to_pick(page, 2)
    assert [p.decided.object_id for p in read_trial(next(game.root.iterdir())).picks if p.decided] == [1]


def test_giving_up_asks_first(game, open_page):
    with game.served() as client:
        page = open_page(client.url)
        page.click("#start")
        _ready_to_pick(page, 1)
        page.keyboard.press("g")
        page.locator("#confirm button", has_text="Go on").click()
        assert game.session.state.phase is Phase.CHOOSING
        page.keyboard.press("g")
        page.locator("#confirm button", has_text="Give up").click()
        page.locator("#ended", has_text="not retrieved (gave up)").wait_for()


def test_nothing_is_shown_of_the_working_robot(game, open_page):
    game.may_move.clear()
    with game.served() as client:
        page, asked = open_page(client.url), []
        page.on("request", lambda r: asked.append(r.url))
        page.click("#start")
        _ready_to_pick(page, 1)
        assert page.locator("#reference").is_hidden()
        seen = page.locator("#seen").get_attribute("src")
        page.keyboard.press("1")
        page.click("#pick")
        page.locator("#says", has_text="The robot picks object 1").wait_for()
        assert page.locator("#robot").is_hidden()
        assert page.locator("#seen").get_attribute("src") == seen
        game.may_move.set()
        _ready_to_pick(page, 2)
    assert not [url for url in asked if "robot.jpg" in url or "video" in url]


def test_with_the_outside_view_the_robot_is_shown_while_it_works_and_that_is_said(tmp_path, open_page):
    import numpy as np

    from torc.web.frames import jpeg

    game = Game(tmp_path / "human", outside_view=True)
    game.may_move.clear()
    with game.served() as client:
        page = open_page(client.url)
        page.click("#start")
        _ready_to_pick(page, 1)
        assert page.locator("#robot").is_hidden()
        page.locator("#reference", has_text="a reference").wait_for()
        page.keyboard.press("1")
        page.click("#pick")
        page.locator("#says", has_text="The robot picks object 1").wait_for()
        game.board.put(jpeg(np.full((420, 560, 3), 90, np.uint8)))
        page.locator("#robot").wait_for()
        game.may_move.set()
        _ready_to_pick(page, 2)
        assert page.locator("#robot").is_hidden()


def test_an_expert_is_told_the_task_and_led_to_the_replay(game, open_page):
    with game.served() as client:
        page = open_page(client.url)
        page.locator("#explained", has_text="as few picks as possible").wait_for()
        page.click("#start")
        _ready_to_pick(page, 1)
        assert page.locator("#explained").is_hidden()
        page.keyboard.press("0")
        for number in ("1", "0"):
            page.keyboard.press(number)
            page.locator("#pick", has_text=f"Pick {number}").wait_for()
            page.click("#pick")
            if number == "1":
                _ready_to_pick(page, 2)
        page.locator("#ended", has_text="retrieved in 2 picks").wait_for()
        with page.expect_popup() as opened:
            page.click("#ended a")
        replay = opened.value
        replay.locator("#says", has_text="Pick 1: object 1, removed").wait_for()
        replay.keyboard.press("ArrowRight")
        replay.locator("#says", has_text="Pick 2: object 0, retrieved").wait_for()
        assert replay.locator("#show-trials").is_hidden()


def test_nothing_overlaps_or_sticks_out(game, open_page):
    with game.served() as client:
        page = open_page(client.url)
        page.click("#start")
        _ready_to_pick(page, 1)
        page.keyboard.press("1")
        for width, height in ((1280, 720), (1920, 1080), (1024, 768), (768, 1024)):
            page.set_viewport_size({"width": width, "height": height})
            names = ("#stage", "#panel", "#action", "header", "#pick")
            stage, panel, action, header, pick = (page.locator(name).bounding_box() for name in names)
            for box in (stage, panel, action, header, pick):
                assert box["x"] >= 0
                assert box["x"] + box["width"] <= width
            assert pick["y"] + pick["height"] <= height
            if width > 1000:
                assert stage["x"] + stage["width"] <= panel["x"]
                assert panel["y"] + panel["height"] <= action["y"]
