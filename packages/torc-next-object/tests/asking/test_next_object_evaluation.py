"""`torc vlm-eval` against servers that behave well, badly, or not."""

import json
import os

import pytest

from next_object_helpers.tiny_next_object import tiny_replies, tiny_rows, write_tiny
from tests.helpers.vlm_server import Broken, Fail, FakeVlmServer, Raw, Say
from torc.cli.main import parse
from torc.errors import InputError
from torc.vlm.clients.api import OWN_SERVER_VARIABLE
from torc_next_object.asking.evaluation import MOST_IN_A_ROW, data_digest, question_of
from torc_next_object.replies import read_number
from torc_next_object.scoring import score_answers

ROWS = sorted(tiny_rows(), key=lambda row: row.id)
KEY = "key-of-torc-testing-0123456789"


@pytest.fixture
def data(tmp_path, monkeypatch):
    monkeypatch.setenv(OWN_SERVER_VARIABLE, KEY)
    return write_tiny(tmp_path / "data", ROWS)


def evaluate(server, data, *more, out="out"):
    """Exit code and scores.json; one question at a time, so that the script's order is the rows'."""
    line = ["vlm-eval", "--vlm", f"openai:some-model@{server.url}", "--data", str(data)]
    line += ["--out", str(data.parent / out), "--workers", "1", "--yes", "--vlm-retries", "0", *more]
    code = parse(line).run()
    return code, json.loads((data.parent / out / "scores.json").read_text())


def lines_of(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def in_all_files(directory):
    return b"".join(p.read_bytes() for p in directory.rglob("*") if p.is_file()).decode(errors="replace")


def test_scores_are_those_of_scoring(data, capsys):
    replies = tiny_replies(ROWS)
    with FakeVlmServer("openai", [Say(replies[row.id] or " ") for row in ROWS], KEY) as server:
        code, found = evaluate(server, data, "--vlm-prices", "1,10,EUR")
    told = capsys.readouterr()
    wanted = score_answers((r.to_dict(), read_number(replies[r.id], r.numbers)) for r in ROWS).to_dict()
    assert (code, found["scores"]) == (0, wanted)
    assert (found["answered"], found["not_answered"]) == (12, 0)
    assert found["use"] == {"tokens_sent": 3600, "tokens_written": 300, "cost": 0.0066, "currency": "EUR"}
    assert "12 questions, about" in told.err
    assert "EUR" in told.err
    names = [line.split()[1] for line in told.out.splitlines()[2:5]]
    assert names[0].startswith("openai:some-model@")
    assert {*names[1:]} == {"random", "dg-select"}
    for asked, row in zip(server.asked, ROWS):
        assert (asked.prompt, asked.images) == (
            question_of(row.to_dict(), "image").prompt,
            (row.image, *row.references),
        )
    assert found["baselines"]["random"]["regret"] is not None


ODD = {
    "empty": (Say(""), None),
    "refusal": (Say("", "refused"), None),
    "cut off": (Say("The best choice is", "truncated"), None),
    "huge": (Say("x" * 3_000_000), None),
    "wrong number": (Say("Answer: 77"), None),
    "negative": (Say("Answer: -3"), None),
    "letters": (Say("Answer: C"), None),
    "html as a reply": (Say("<script>alert(1)</script><h1>Gateway</h1>"), None),
    "control characters": (Say("\u202e\x00Answer: zero\x1b[2J"), None),
    "key echoed": (Say(f"Your key {KEY}. Answer: {{first}}"), 0),
    "HTML page": (Raw(b"<h1>Bad gateway</h1>", 502, {"content-type": "text/html"}), "server error"),
    "HTML with 200": (Raw(b"<html>hello</html>", 200, {"content-type": "text/html"}), "not an answer"),
    "rate limit": (Fail(429), "rate limit"),
    "bad request": (Fail(400, f"bad key {KEY}"), "request refused"),
    "hang up": (Broken.HANG_UP, "no connection"),
    "JSON of another form": (Raw(b'{"choices": []}'), "not an answer"),
    "deep JSON": (Raw(b"[" * 100_000), "not an answer"),
}


def test_an_odd_reply_is_invalid_and_a_failure_is_no_reply(data):
    """One row gets each; further rows are answered well."""
    rows = sorted(tiny_rows(2 * len(ODD)), key=lambda row: row.id)
    script = []
    for i, (behavior, _) in enumerate(ODD.values()):
        if isinstance(behavior, Say):
            first = str(rows[2 * i].numbers[0])
            behavior = behavior._replace(text=behavior.text.replace("{first}", first))
        script += [behavior, Say(f"Answer: {rows[2 * i + 1].best[0]}")]
    with FakeVlmServer("openai", script, KEY) as server:
        code, found = evaluate(server, write_tiny(data, rows))
    out = data.parent / "out"
    failed = {line["id"]: line["why"] for line in lines_of(out / "failures.jsonl")}
    replied = {line["id"]: line["reply"] for line in lines_of(out / "replies.jsonl")}
    for row, (case, (_, meaning)) in zip(rows[::2], ODD.items()):
        assert (row.id in failed, row.id in replied) == (
            isinstance(meaning, str),
            not isinstance(meaning, str),
        ), case
        if isinstance(meaning, str):
            assert meaning in failed[row.id], case
        else:
            assert read_number(replied[row.id], row.numbers) == (
                None if meaning is None else row.numbers[0]
            ), case
    meanings = [meaning for _, meaning in ODD.values()]
    failures = sum(isinstance(meaning, str) for meaning in meanings)
    assert (code, found["not_answered"]) == (1, failures)
    assert found["scores"]["invalid"] == round(meanings.count(None) / (len(rows) - failures), 4)
    everything = in_all_files(out)
    assert KEY not in everything
    assert "<script" not in (out / "worst.html").read_text()
    assert len(everything) < 2_000_000


def test_it_goes_on_where_it_was(data):
    """After failures, and after a crash that cut off the last line."""
    answers = [Say(f"Answer: {row.best[0]}") for row in ROWS]
    with FakeVlmServer("openai", [*answers[:5], Fail(500), *answers[6:]], KEY) as server:
        assert evaluate(server, data)[0] == 1
        file = data.parent / "out" / "replies.jsonl"
        file.write_text(file.read_text()[:-30])
        server.script, before = [answers[5], answers[11]], len(server.asked)
        code, found = evaluate(server, data)
        assert (code, len(server.asked) - before) == (0, 2)
        assert (found["answered"], found["scores"]["top1"]) == (12, 1.0)
        assert sorted(line["id"] for line in lines_of(file)) == sorted(row.id for row in ROWS)
        server.script, before = [Fail(500)], len(server.asked)
        again = evaluate(server, data)
        assert (again[0], len(server.asked), again[1]["scores"]) == (0, before, found["scores"])


def test_a_higher_limit_asks_only_what_is_new(data):
    with FakeVlmServer("openai", [Say("Answer: 0")], KEY) as server:
        assert evaluate(server, data, "--limit", "3")[1]["rows"] == 3
        assert evaluate(server, data, "--limit", "5")[1]["rows"] == 5
        assert len(server.asked) == 5


@pytest.mark.parametrize(
    ("failure", "asked"),
    [
        (Fail(401), 1),
        (Fail(404), 1),
        (Fail(500), MOST_IN_A_ROW),
        (Fail(429), MOST_IN_A_ROW),
        (Fail(400), MOST_IN_A_ROW),
    ],
)
def test_a_hopeless_server_is_given_up(data, failure, asked, capsys):
    with FakeVlmServer("openai", [failure], KEY) as server:
        line = ["vlm-eval", "--vlm", f"openai:m@{server.url}", "--data", str(data), "--yes"]
        line += ["--out", str(data.parent / "none"), "--workers", "1", "--vlm-retries", "0"]
        assert parse(line).run() == 1
    assert len(server.asked) == asked
    assert "answered no question" in capsys.readouterr().err


def test_many_at_a_time_give_the_same_scores(data):
    with FakeVlmServer("openai", [Say("Answer: 3")], KEY) as server:
        one = evaluate(server, data)[1]
        many = evaluate(server, data, "--workers", "6", out="many")[1]
    assert many["scores"] == one["scores"]
    assert many["replies_sha256"] == one["replies_sha256"]


@pytest.mark.parametrize("more", [["--variant", "grasps"], ["--vlm-temperature", "0.5"]])
def test_other_questions_want_another_directory(data, more):
    with FakeVlmServer("openai", [Say("Answer: 3")], KEY) as server:
        evaluate(server, data)
        with pytest.raises(InputError, match="Choose another --out"):
            evaluate(server, data, *more)


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (["--vlm-plain"], "data set's own"),
        (["--workers", "0"], "at least 1"),
        (["--limit", "0"], "at least 1"),
        (["--split", "train"], "no decisions in its split 'train'"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_asked(data, more, told):
    with FakeVlmServer("openai", [Say("Answer: 3")], KEY) as server, pytest.raises(InputError, match=told):
        evaluate(server, data, *more)
    assert server.headers == []


def test_nothing_is_asked_without_consent(data, monkeypatch, capsys):
    out = data.parent / "out"
    with FakeVlmServer("openai", [Say("Answer: 3")], KEY) as server:
        line = ["vlm-eval", "--vlm", f"openai:m@{server.url}", "--data", str(data), "--out", str(out)]
        with open(os.devnull) as nothing:
            monkeypatch.setattr("sys.stdin", nothing)
            with pytest.raises(InputError, match="--yes"):
                parse(line).run()
    assert server.headers == []
    assert "12 questions" in capsys.readouterr().err


def test_a_cache_replays_without_a_server(data):
    cache = ["--vlm-cache", str(data.parent / "cache")]
    with FakeVlmServer("openai", [Say("Answer: 3")], KEY) as server:
        recorded = evaluate(server, data, *cache)[1]
        replayed = evaluate(server, data, *cache, "--vlm-cache-mode", "replay", out="again")[1]
    assert len(server.asked) == 12
    assert replayed["scores"] == recorded["scores"]


def test_the_worst_mistakes_are_shown_with_the_best_choice(data):
    worst = {row.id: row.numbers[row.values.index(max(row.values))] for row in ROWS}
    with FakeVlmServer(
        "openai", [Say(f"<b>Because.</b> Answer: {worst[row.id]}") for row in ROWS], KEY
    ) as server:
        evaluate(server, data)
    page = (data.parent / "out" / "worst.html").read_text()
    lost = {row.id: max(row.values) - min(row.values) for row in ROWS}
    order = sorted((row.id for row in ROWS if worst[row.id] not in row.best), key=lambda i: -lost[i])
    assert [part.split('"')[0] for part in page.split('<article id="')[1:]] == order
    for row in ROWS:
        if row.id in order:
            assert f"Chose {worst[row.id]}: {lost[row.id]:.2f} picks lost" in page
    assert "&lt;b&gt;Because.&lt;/b&gt;" in page
    assert "<b>" not in page


def test_the_digest_is_of_what_is_asked_and_worth(data):
    rows = [row.to_dict() for row in ROWS]
    digest = data_digest(rows, "image")
    assert data_digest(rows[::-1], "image") == digest
    assert data_digest([rows[0] | {"values": (9.0, *rows[0]["values"][1:])}, *rows[1:]], "image") != digest
    assert data_digest([rows[0] | {"image": b"other"}, *rows[1:]], "image") != digest
    assert data_digest(rows, "grasps") != digest


def test_without_data_it_says_how_to_make_some(data):
    line = [
        "vlm-eval",
        "--vlm",
        "openai:m@http://127.0.0.1:1",
        "--data",
        "no_such_data",
        "--out",
        "x",
        "--yes",
    ]
    with pytest.raises(
        InputError, match="torc next-object make --problems torc40 --decisions 60 --out no_such_data"
    ):
        parse(line).run()
