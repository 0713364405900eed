"""The page of `torc camera show`: the newest picture with its facts, and nothing for strangers."""

import json
import threading

import pytest
from page_server import Client

from torc.web.app import make_camera_app
from torc.web.frames import FrameBoard
from torc.web.serving import listen, serving_app


@pytest.fixture
def board():
    return FrameBoard()


@pytest.fixture
def client(board):
    """A server of the page."""
    sock = listen("127.0.0.1", 0)
    port = sock.getsockname()[1]
    with serving_app(make_camera_app(board, None, port), sock):
        yield Client(port)


def test_the_page_loads_nothing_from_elsewhere(client):
    page = client.get("/")
    assert b"<title>torc camera</title>" in page.body
    assert "default-src 'none'" in page.headers["content-security-policy"]
    for name in ("camera.js", "camera.css", "style.css"):
        assert client.get(f"/page/{name}").status == 200
    assert client.get("/", Host="evil.example").status == 403


def test_the_newest_picture_comes_with_its_facts(board, client):
    board.put(b"first", {"depth": "at 90 %"})
    board.put(b"second", {"depth": "at 95 %", "no masks": "nothing ✓"})
    found = client.get("/api/camera.jpg?after=0")
    assert (found.body, found.headers["x-frame"]) == (b"second", "2")
    assert json.loads(found.headers["x-facts"]) == {"depth": "at 95 %", "no masks": "nothing ✓"}
    assert board.watched


def test_who_has_the_newest_waits_for_the_next(board, client):
    board.put(b"first", {})
    timer = threading.Timer(0.2, board.put, (b"second", {}))
    timer.start()
    assert client.get("/api/camera.jpg?after=1").body == b"second"
    timer.join()


def test_trouble_is_told_beside_the_last_picture(board, client):
    board.put(b"first", {"depth": "at 90 %"})
    board.trouble("The camera is gone.")
    found = client.get("/api/camera.jpg?after=1")
    assert found.body == b"first"
    assert json.loads(found.headers["x-facts"]) == {"trouble": "The camera is gone."}


def test_a_page_may_have_a_task_of_its_own():
    board = FrameBoard("Lay the scene out.")
    board.put(b"first", {"object 1": "0.50"})
    assert board.watch()[2] == {"object 1": "0.50", "task": "Lay the scene out."}
    board.trouble("The camera is gone.")
    assert board.watch()[2]["task"] == "Lay the scene out."
    assert "task" not in FrameBoard().watch()[2]
