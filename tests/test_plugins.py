"""From names to parts that anybody may have written."""

import sys

import pytest

from torc.errors import InputError, TorcError, UnknownNameError
from torc.io.digests import file_fingerprint, part_source
from torc.plugins import PartKind, blamed, load_part, make_part, part_paths, short_part_name, takes

KIND = PartKind("sort of part", "torc.tests", "act(thing)", {"ours": f"{__name__}:Ours"})


class Ours:
    def __init__(self, size=1):
        self.size = size

    def act(self, thing):
        return self.size, thing


class Greedy(Ours):
    def __init__(self, config, size):
        super().__init__(size)
        self.config = config


class Idle:
    pass


class Breaks:
    def __init__(self):
        raise SystemExit(3)


def test_options_are_needed_and_offers_are_taken_by_name():
    assert make_part(KIND, "ours", {}, {"config": 7}).size == 1
    assert make_part(KIND, "ours", {"size": 3}, {"config": 7}).size == 3
    greedy = make_part(KIND, f"{__name__}:Greedy", {"size": 2}, {"config": 7, "other": 8})
    assert (greedy.config, greedy.size) == (7, 2)
    assert takes(KIND, f"{__name__}:Greedy", "config")
    assert not takes(KIND, "ours", "config")


@pytest.mark.parametrize(
    ("name", "told"),
    [
        (f"{__name__}:Idle", "needs a method `act\\(thing\\)`; Idle has none"),
        (f"{__name__}:Breaks", "could not be made: SystemExit: 3"),
        (f"{__name__}:Greedy", "does not take the options"),
        (f"{__name__}:Nobody", "has no 'Nobody'"),
        (f"{__name__}:KIND", "PartKind, not a class"),
        ("no_such_module:Ours", "importing no_such_module failed"),
        (":Ours", "module:Class"),
        ("ors", "Did you mean 'ours'"),
    ],
)
def test_what_cannot_be_made_is_said_in_a_sentence(name, told):
    with pytest.raises(InputError, match=told) as caught:
        make_part(KIND, name, {}, {})
    assert "sort of part" in str(caught.value).lower()


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A working directory with files of somebody's; one of them uses another one beside it."""
    (tmp_path / "deep down").mkdir()
    (tmp_path / "mine.py").write_text("class Mine:\n    def act(self, thing): return 'mine'\n")
    (tmp_path / "deep down" / "mine.py").write_text(
        "from beside import WORD\nclass Mine:\n    def act(self, thing): return WORD\n"
    )
    (tmp_path / "deep down" / "beside.py").write_text("WORD = 'deep'\n")
    (tmp_path / "needs_more.py").write_text("import no_such_library")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", [*sys.path, str(tmp_path)])
    return tmp_path


def test_a_part_is_loaded_from_its_file_wherever_that_lies(here):
    for name in ("deep down/mine.py:Mine", f"{here}/deep down/mine.py:Mine"):
        part = make_part(KIND, name, {})
        assert part.act(None) == "deep"
        assert part_source(type(part)) == file_fingerprint(here / "deep down" / "mine.py")
    assert make_part(KIND, "mine.py:Mine", {}).act(None) == "mine"
    assert load_part(KIND, "mine.py:Mine") is load_part(KIND, "mine.py:Mine")


def test_a_file_without_the_part_is_said_to_be_so(here):
    for name, told in (
        ("no/such.py:Mine", "there is no file 'no/such.py'. Looked for"),
        ("needs_more.py:Mine", "No module named 'no_such_library'"),
        ("needs_more.py:Mine", "No module named"),  # what failed once is not taken for loaded
        ("mine.py:Nobody", "has no 'Nobody'"),
        ("mine.py:", "must be written module:Class"),
    ):
        with pytest.raises(InputError, match=told):
            make_part(KIND, name, {})


def test_names_for_files_hold_no_directory():
    names = [short_part_name(n) for n in ("ours", "a.b:C", "x y/../b.py:C", "b:C")]
    assert names == ["ours", "a.b.C", "b.C", "b.C"]


def test_installed_packages_add_names_but_replace_none(monkeypatch):
    class Point:
        def __init__(self, name, value):
            self.name, self.value = name, value

    points = [Point("theirs", f"{__name__}:Ours"), Point("ours", "somewhere:Else")]
    monkeypatch.setattr("torc.plugins.entry_points", lambda group: points if group == KIND.group else [])
    assert part_paths(KIND) == {"theirs": f"{__name__}:Ours", "ours": f"{__name__}:Ours"}
    assert make_part(KIND, "theirs", {}).act(1) == (1, 1)
    with pytest.raises(UnknownNameError, match="theirs"):
        make_part(KIND, "thiers", {})


def test_what_a_part_raises_is_blamed_on_it_with_the_line():
    class PartError(TorcError):
        pass

    where = r"It failed with ZeroDivisionError.*test_plugins\.py, line"
    with pytest.raises(PartError, match=where) as caught, blamed("It", PartError, "Ask its author."):
        _ = 1 / 0
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    with pytest.raises(InputError, match="as it is"), blamed("It", PartError, ""):
        raise InputError("as it is")
