"""The page of `torc camera show` in a real headless browser."""

import numpy as np
import pytest

from torc.web.app import make_camera_app
from torc.web.frames import FrameBoard, jpeg
from torc.web.serving import listen, serving_app

pytestmark = pytest.mark.browser


def test_pictures_and_facts_follow_each_other_and_trouble_is_told(open_page):
    board, sock = FrameBoard(), listen("127.0.0.1", 0)
    port = sock.getsockname()[1]
    board.put(jpeg(np.full((48, 144, 3), 90, np.uint8)), {"objects": "3", "depth": "at <b>90</b> %"})
    with serving_app(make_camera_app(board, None, port), sock):
        page = open_page(f"http://127.0.0.1:{port}/")
        page.locator("#facts dd", has_text="at <b>90</b> %").wait_for()
        page.wait_for_function("document.getElementById('picture').naturalWidth === 144")
        board.put(jpeg(np.full((48, 96, 3), 90, np.uint8)), {"objects": "4"})
        page.locator("#facts dd", has_text="4").wait_for()
        page.wait_for_function("document.getElementById('picture').naturalWidth === 96")
        board.trouble("RealSense: no picture within 5 s")
        page.locator("#trouble", has_text="no picture within 5 s").wait_for()
        assert page.locator("#facts dd").all_text_contents() == ["4"]
        board.put(jpeg(np.zeros((48, 96, 3), np.uint8)), {"objects": "0"})
        page.locator("#trouble").wait_for(state="hidden")


def test_the_page_says_what_it_is_for(open_page):
    board, sock = FrameBoard("Lay the scene out."), listen("127.0.0.1", 0)
    port = sock.getsockname()[1]
    board.put(jpeg(np.full((48, 144, 3), 90, np.uint8)), {"object 2": "0.08"})
    with serving_app(make_camera_app(board, None, port), sock):
        page = open_page(f"http://127.0.0.1:{port}/")
        page.locator("#task", has_text="Lay the scene out.").wait_for()
        assert page.locator("#facts dt").all_text_contents() == ["object 2"]
