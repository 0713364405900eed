"""The expert's page in a real headless browser, with fakes for the robot."""

import pytest
from page_server import Game

from torc.drawing.label_places import mask_anchor
from torc.trials.recorded import read_trial

pytestmark = pytest.mark.browser


@pytest.fixture
def game(tmp_path):
    return Game(tmp_path / "human")


def _click(page, game, object_id):
    """Click on a pixel of the object in the image."""
    (directory,) = game.root.glob("*.partial")
    label = read_trial(directory).view(game.session.state.pick).label_image
    row, col = mask_anchor(label == object_id)
    if page.get_attribute("#zoom", "aria-pressed") == "true":
        page.click("#zoom")
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


def test_a_target_that_the_robot_does_not_recognise_is_named_by_the_person(tmp_path, open_page):
    game = Game(tmp_path / "human", names={0: 3, 1: 1, 2: 2})
    with game.served() as client:
        page = open_page(client.url)
        page.click("#start")
        _ready_to_pick(page, 1)
        assert page.locator("#is-target").count() == 0
        page.keyboard.press("1")
        assert not page.locator("#is-target").is_checked()
        page.keyboard.press("Enter")
        _ready_to_pick(page, 2)
        page.keyboard.press("3")
        page.locator("#pick", has_text="Pick 3").wait_for()
        page.keyboard.press("t")
        page.locator("#pick", has_text="Pick 3, the target").wait_for()
        assert page.locator("#is-target").is_checked()
        page.click("#pick")
        page.locator("#ended", has_text="retrieved in 2 picks").wait_for()
    (directory,) = game.root.iterdir()
    assert [p.decided.is_target for p in read_trial(directory).picks] == [False, True]


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
