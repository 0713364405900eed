"""The child process answers, is refused, or ends; the parent always goes on."""

import os
import time
from pathlib import Path

import pytest

from torc.objects.importing.guard import ChildError, run_child


@pytest.fixture(autouse=True)
def _tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    here = str(Path(__file__).parent)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [here, os.environ.get("PYTHONPATH", "")])))


def _run(task: str, directory: Path, limit_s: float = 60.0) -> dict[str, object]:
    return run_child(f"tasks_for_tests:{task}", {"number": 4}, directory, limit_s, 2 * 2**30)


def test_an_answer_comes_back(tmp_path: Path) -> None:
    assert _run("answer", tmp_path) == {"twice": 8}
    assert (tmp_path / "left.txt").read_text() == "here"


@pytest.mark.parametrize(
    ("task", "message"),
    [
        ("fail", "KeyError: 'inner fault'"),
        ("eat", r"more memory than 2\.0 GB"),
        ("die", "SIGABRT"),
        ("leave", "code 7"),
    ],
)
def test_every_end_is_told(task: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(ChildError, match=message):
        _run(task, tmp_path)


def test_a_busy_child_is_ended(tmp_path: Path) -> None:
    with pytest.raises(ChildError, match="longer than 1 s of computing"):
        _run("spin", tmp_path, limit_s=1.0)


def test_a_hanging_child_and_what_it_started_are_ended(tmp_path: Path) -> None:
    with pytest.raises(ChildError, match="longer than 1 s of computing"):
        _run("hang", tmp_path, limit_s=1.0)
    group = int((tmp_path / "pid.txt").read_text())
    for _ in range(100):  # until the system has cleared them away
        if not _alive(group):
            break
        time.sleep(0.05)
    assert not _alive(group)


def _alive(group: int) -> bool:
    """Whether a process of the group still runs; the dead that nobody has collected do not count."""
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = entry.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == group and fields[0] != "Z":
            return True
    return False
