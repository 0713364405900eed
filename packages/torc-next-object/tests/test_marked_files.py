"""Windows editors begin UTF-8 files with a byte-order mark: every file that a user writes is read with one."""

import json

from torc_next_object.asking.evaluation import RecordedReply, ReplyFile
from torc_next_object.cli.next_object import read_replies
from torc_next_object.making.known_values import KnownValues

MARK = b"\xef\xbb\xbf"


def marked(path, text):
    path.write_bytes(MARK + text.encode("utf-8"))
    return path


def test_files_of_the_data_set(tmp_path):
    line = json.dumps({"id": "a", "reply": "Answer: 1", "values": {"1": [2.0, 1.0, 3.0]}}) + "\n"
    path = marked(tmp_path / "replies.jsonl", line)
    assert read_replies(path) == {"a": "Answer: 1"}
    known = KnownValues(path).get("a")
    assert known is not None
    assert known[1].mean == 2.0
    (tmp_path / "run").mkdir()
    ReplyFile(tmp_path / "run").add(RecordedReply("b", "Answer: 2"))
    written = tmp_path / "run" / "replies.jsonl"
    marked(written, written.read_text(encoding="utf-8"))
    assert ReplyFile(tmp_path / "run").found["b"].reply == "Answer: 2"
