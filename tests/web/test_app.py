"""The addresses of the page, over plain HTTP."""

import json
from dataclasses import replace

import pytest
from page_server import Game

from tests.helpers.fake_trial import play_fake_trial
from torc.errors import InputError
from torc.io.results import write_json
from torc.pipeline.building import sources
from torc.pipeline.planners import make_planner
from torc.robots.schema import EXAMPLE
from torc.specs.conditions import Conditions
from torc.specs.spec_files import to_plain
from torc.specs.trial import TrialSpec
from torc.trials.recorded import BELIEF
from torc.trials.viewer_links import REPORT, trial_key, trial_link
from torc.web.session import Choice, Phase, Session
from torc.web.shelf import make_queue


def test_the_viewer_serves_a_whole_trial(client):
    found = client.get("/api/trials").json
    assert found["mode"] == "view"
    (line,) = found["trials"]
    base = f"/api/trials/{line['key']}"
    assert client.get(base).json["problem"] == "boxes"
    assert client.get(f"{base}/picks/0").json["chosen"] == 1
    assert client.get(f"{base}/picks/0/seen.png").body.startswith(b"\x89PNG")
    assert client.get(f"{base}/picks/0/small.jpg").body.startswith(b"\xff\xd8")
    assert int.from_bytes(client.get(f"{base}/picks/0/arrays").body[:4], "little") < 5000
    assert client.get("/").body.startswith(b"<!doctype html>")


def test_the_viewer_shows_what_a_model_was_sent(client, recorded):
    picks = recorded / "boxes" / "picks"
    for name in ("00_sent_1.png", "00_sent_2.png"):
        (picks / name).write_bytes((picks / "00_seen.png").read_bytes() + name.encode())
    base = f"/api/trials/{client.get('/api/trials').json['trials'][0]['key']}/picks"
    assert [client.get(f"{base}/{pick}").json["sent"] for pick in (0, 1)] == [2, 0]
    assert client.get(f"{base}/0/sent/1.png").body == (picks / "00_sent_2.png").read_bytes()
    assert client.get(f"{base}/0/sent/2.png").status == 404


def test_what_is_not_there_is_not_found(client):
    key = client.get("/api/trials").json["trials"][0]["key"]
    trial = ("nothing", "..%2f..%2fetc", f"{key}/picks/99", f"{key}/picks/-1", f"{key}/video.mp4")
    deep = (f"{key}/picks/..%2f..%2fspec.json/seen.png",)
    page = ("/page/..%2fapp.py", "/page/../app.py", "/page/none.js", "/api/session", "/api/robot.jpg")
    for path in (*(f"/api/trials/{part}" for part in trial + deep), *page):
        assert client.get(path).status == 404, path


def test_a_report_is_served_with_links_that_work_at_any_port(client, recorded):
    assert client.get("/api/trials").json["report"] is False
    none = client.get("/report")
    assert (none.status, "torc report" in none.json["error"]) == (404, True)
    (recorded / "report").mkdir()
    link = trial_link(recorded, recorded / "boxes", 1)
    text = '<a href="#trials">Trials</a>'
    (recorded / REPORT).write_text(f'{text}<a href="{link}">{link}</a>')
    assert client.get("/api/trials").json["report"] is True
    served = client.get("/report")
    key = client.get("/api/trials").json["trials"][0]["key"]
    assert served.body.decode() == f'{text}<a href="/#{key}/1">{link}</a>'
    assert "script-src" not in served.headers["content-security-policy"]
    assert "default-src 'none'" in served.headers["content-security-policy"]


@pytest.mark.parametrize("linked", ["report", "report/index.html"])
def test_a_report_that_is_a_link_to_elsewhere_is_not_served(client, recorded, tmp_path, linked):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "index.html").write_text("secret")
    (recorded / linked).parent.mkdir(exist_ok=True)
    (recorded / linked).symlink_to(elsewhere if linked == "report" else elsewhere / "index.html")
    answer = client.get("/report")
    assert answer.status == 404
    assert b"secret" not in answer.body


@pytest.fixture
def game(tmp_path):
    return Game(tmp_path / "human")


def _start(game, client):
    game.wait(Phase.READY)
    key = client.get("/api/session").json["waiting"][0]
    assert client.post("/api/session/start", {"trial": key}).status == 200
    return key


def test_a_whole_episode_over_http_is_recorded_like_any_other(game):
    with game.served() as client:
        key = _start(game, client)
        game.wait(Phase.CHOOSING, 0)
        assert client.get("/api/trials").json["outside"] is False
        assert client.get("/api/robot.jpg").status == 404
        note = "it hides the most"
        done = client.post("/api/session/choose", {"trial": key, "pick": 0, "object_id": 1, "note": note})
        assert done.json["chosen"] == 1
        state = game.wait(Phase.CHOOSING, 1)
        assert 0 in state.allowed
        client.post("/api/session/choose", {"trial": key, "pick": 1, "object_id": 0})
        game.wait(Phase.DONE)
        assert client.get(f"/api/trials/{key}").json["result"]["retrieved"] is True
    directory = game.root / "one-human-anna-0"
    decided = [json.loads(x) for x in (directory / "events.jsonl").read_text().splitlines()]
    decided = [line for line in decided if line["event"] == "decided"]
    assert [d["object_id"] for d in decided] == [1, 0]
    assert decided[0]["reason"] == note
    assert decided[0]["evidence"] == {"expert": "anna", "note": note}
    assert decided[1]["exchanges"][0]["reply"] == "0"
    assert json.loads((directory / "spec.json").read_text())["planner"]["expert"] == "anna"


def test_double_stale_and_impossible_choices_are_refused(game):
    game.may_move.clear()
    with game.served() as client:
        key = _start(game, client)
        game.wait(Phase.CHOOSING, 0)
        choice = {"trial": key, "pick": 0, "object_id": 1}
        refused = client.post("/api/session/choose", {**choice, "object_id": 9})
        assert (refused.status, "cannot be grasped" in refused.json["error"]) == (409, True)
        for wrong in ({"pick": 3}, {"trial": "other"}, {"object_id": None}):
            assert client.post("/api/session/choose", {**choice, **wrong}).status == 409
        assert client.get("/api/session").json["phase"] == "choosing"
        assert client.post("/api/session/choose", choice).status == 200
        again = client.post("/api/session/choose", {**choice, "object_id": 2})
        assert (again.status, again.json["error"]) == (409, "Pick 1 has been decided already: object 1.")
        assert client.post("/api/session/start", {"trial": key}).status == 409
        game.may_move.set()
        game.wait(Phase.CHOOSING, 1)
        assert client.post("/api/session/choose", choice).status == 409


def test_nonsense_is_refused_and_changes_nothing(game):
    with game.served() as client:
        game.wait(Phase.READY)
        before = client.get("/api/session").json
        wrong = [b'{"trial": 1, "pick": 0}', b'{"trial": "a", "pick": "0"}', b"9" * 5000]
        for body in (b"", b"[]", b"{}", b"nonsense", b"\xff\xfe", *wrong):
            assert client.post("/api/session/choose", body).status == 400
        assert client.post("/api/session/choose", {}, **{"Content-Type": "text/plain"}).status == 400
        assert client.get("/api/session").json == before


def test_while_a_problem_is_to_be_played_nothing_that_has_ended_is_told_of_it(tmp_path):
    """Two experts, and a trial of somebody else's: what tells all waits for the last of them."""
    root = tmp_path / "human"
    theirs = play_fake_trial(TrialSpec.of("one", "random"), root / "theirs", make_planner("random"))
    (theirs.directory / "video.mp4").write_bytes(b"the outside")
    game = Game(root, experts=("anna", "ben"))
    paths = [f"/api/trials/{trial_key('theirs')}{part}" for part in ("", "/picks/0", "/video.mp4")]
    with game.served() as client:
        for _ in range(2):
            key = _start(game, client)
            game.wait(Phase.CHOOSING)
            assert [client.get(path).status for path in paths] == [404] * 3
            assert "still to be played" in client.get(paths[0]).json["error"]
            own = client.get(f"/api/trials/{key}").json
            assert (own["names"], own["video"], own["result"]) == ([], False, None)
            assert client.get(f"/api/trials/{key}/video.mp4").status == 404
            client.post("/api/session/choose", {"trial": key, "pick": 0, "give_up": True})
        game.wait(Phase.DONE)
        assert [client.get(path).status for path in paths] == [200] * 3
        assert client.get(f"/api/trials/{key}").json["names"] != []


def test_robot_pictures_come_in_order_and_only_new_ones(tmp_path):
    game = Game(tmp_path / "human", outside_view=True)
    with game.served() as client:
        game.wait(Phase.READY)
        assert game.queue.trials[0].directory.name == "one-human-anna-outside-0"
        assert not game.board.watched
        game.board.put(b"one")
        first = client.get("/api/robot.jpg")
        assert (first.body, first.headers["x-frame"]) == (b"one", "1")
        assert game.board.watched
        game.board.put(b"two")
        assert client.get("/api/robot.jpg?after=1").body == b"two"
        assert client.get("/api/robot.jpg?after=nonsense").body == b"two"


@pytest.mark.parametrize(
    ("now", "said"),
    [({"max_picks": 5}, "at most 5 picks"), ({"noise": True}, "noise"), ({"robot": str(EXAMPLE)}, "robot")],
)
def test_a_trial_that_was_played_otherwise_is_not_taken_for_this_one(tmp_path, now, said):
    wanted = Conditions(**now)
    (there,) = make_queue(("one",), (), tmp_path, 0, wanted).trials
    there.directory.mkdir()
    (there.directory / "result.json").write_text('{"status": "completed"}')
    write_json(there.directory / "spec.json", to_plain(replace(there.spec, conditions=Conditions()), {}))
    with pytest.raises(InputError, match=f"played with .*; now it would be .*{said}"):
        make_queue(("one",), (), tmp_path, 0, wanted)
    write_json(there.directory / "spec.json", to_plain(there.spec, sources(wanted)))
    assert make_queue(("one",), (), tmp_path, 0, wanted).waiting() == ()


def test_experts_and_problems_need_names_for_files_of_their_own(tmp_path):
    for name in ("../anna", "a b", "-x", "ä", "a" * 40):
        with pytest.raises(InputError, match="expert's name"):
            make_queue(("one",), (name,), tmp_path, 0, Conditions())
    with pytest.raises(InputError, match="same file name"):
        make_queue(("a/one.yaml", "b/one.yaml"), (), tmp_path, 0, Conditions())


def test_a_pick_may_pass_where_nothing_can_be_grasped():
    session = Session()
    session.publish(trial="t", phase=Phase.CHOOSING, pick=2)
    session.choose(Choice("t", 2))
    assert session.state.phase is Phase.PLANNING


def test_a_belief_is_shown_where_a_planner_has_left_one(client, recorded):
    base = f"/api/trials/{client.get('/api/trials').json['trials'][0]['key']}/picks/0"
    assert client.get(f"{base}/belief.png").status == 404
    picture = (recorded / "boxes" / "picks" / "00_seen.png").read_bytes()
    (recorded / "boxes" / "picks" / f"00_{BELIEF}").write_bytes(picture)
    assert client.get(f"{base}/belief.png").body == picture
    (recorded / "boxes" / "picks" / f"00_{BELIEF}").write_bytes(b"<svg>")
    assert client.get(f"{base}/belief.png").status == 404
