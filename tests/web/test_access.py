"""Who gets in, and what a page may load."""

import json
import threading

import pytest
from page_server import Client, served

from torc.specs.trial import TrialSpec
from torc.trials.log import without_seconds
from torc.trials.trial import Recording, run_trial
from torc.web.frames import FrameBoard, RobotCamera
from torc.web.serving import token_for
from torc.web.session import Choice, HumanPlanner, Phase, Session


def test_a_token_is_made_where_others_reach_the_server():
    assert [token_for(host) for host in ("127.0.0.1", "localhost", "::1", "127.9.9.9")] == [None] * 4
    tokens = {token_for(host) for host in ("0.0.0.0", "0.0.0.0", "::")}
    assert (len(tokens), min(map(len, tokens)) >= 32) == (3, True)


def test_only_this_machines_own_names_are_taken(client):
    for host in ("evil.example", "127.0.0.1.evil.example", "127.0.0.1:1", "", "[", "127.0.0.1"):
        refused = client.get("/api/trials", Host=host)
        assert (refused.status, "content-security-policy" in refused.headers) == (403, True)
    for name in ("127.0.0.1", "localhost", "[::1]"):
        assert client.get("/api/trials", Host=f"{name}:{client.port}").status == 200


@pytest.mark.parametrize(
    "headers", [{"Origin": "http://evil.example"}, {"Origin": "null"}, {"Sec-Fetch-Site": "cross-site"}]
)
def test_another_sites_scripts_and_forms_are_refused(client, headers):
    assert client.post("/api/session/choose", {}, **headers).status == 403


def test_without_the_token_nobody_gets_in(recorded):
    with served(recorded, token="secret-token") as client:
        for path in ("/", "/api/trials", "/page/main.js", "/?token=wrong", "/?token="):
            answer = client.get(path)
            assert answer.status == 401, path
            assert b"secret-token" not in answer.body
        assert client.get("/api/trials", Authorization="Bearer wrong").status == 401
        assert client.get("/api/trials", Cookie=f"torc-{client.port}=wrong").status == 401
        assert client.get("/api/trials", Cookie="=;;broken=\xff").status == 401


def test_the_token_becomes_a_cookie_and_leaves_the_address(recorded):
    with served(recorded, token="secret-token") as client:
        first = client.get("/?token=secret-token")
        assert first.status == 303
        assert first.headers["location"] == "/"
        cookie = first.headers["set-cookie"]
        assert "HttpOnly" in cookie
        assert "SameSite=strict" in cookie
        inside = Client(client.port, {"Cookie": cookie.split(";")[0]})
        assert inside.get("/api/trials", Host="my-lab:80").status == 200
        assert client.get("/api/trials", Authorization="Bearer secret-token").status == 200


def test_the_token_is_in_no_log(recorded, capfd):
    with served(recorded, token="secret-token") as client:
        client.get("/?token=secret-token")
        client.get("/nowhere?token=secret-token")
    assert "secret-token" not in "".join(capfd.readouterr())


def test_pages_may_load_nothing_from_elsewhere(client):
    for path in ("/", "/page/main.js", "/api/trials", "/nowhere"):
        headers = client.get(path).headers
        policy = headers["content-security-policy"]
        assert policy.startswith("default-src 'none'")
        assert "http" not in policy
        assert "unsafe" not in policy
        assert headers["x-content-type-options"] == "nosniff"


SPEC = TrialSpec.of("structured-04", "human", max_picks=1)


def _play(out, watch):
    """One pick by a person who takes the first graspable object, watched or not."""
    session, board, over = Session(), FrameBoard(), threading.Event()
    session.publish(trial="t")
    numbers = set()

    def sit_there():
        while not over.wait(0.01):
            state = session.state
            if watch:
                numbers.add(board.watch()[0])
            if state.phase is Phase.CHOOSING:
                session.choose(Choice("t", state.pick, state.allowed[0]))

    person = threading.Thread(target=sit_there, daemon=True)
    person.start()
    try:
        with RobotCamera(board) as camera:
            planner, tell = HumanPlanner(session), session.show
            trial = run_trial(
                SPEC,
                out,
                planner=planner,
                listeners=[tell],
                recording=Recording(observers=(camera.observe,)),
                say=lambda _: None,
            )
    finally:
        over.set()
        person.join()
    assert trial.result.status == "completed"
    lines = (out / "events.jsonl").read_text().splitlines()
    return [without_seconds(json.loads(line)) for line in lines], numbers


@pytest.mark.slow
def test_a_real_pick_is_the_same_whether_watched_or_not(tmp_path):
    watched, numbers = _play(tmp_path / "a", watch=True)
    unwatched, none = _play(tmp_path / "b", watch=False)
    assert watched == unwatched
    assert len(numbers) > 10
    assert none == set()
