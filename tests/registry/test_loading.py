"""From names to parts that anybody may have written."""

import sys

import pytest

from torc.errors import InputError, TorcError, UnknownNameError
from torc.io.digests import file_fingerprint, part_source
from torc.registry import loading
from torc.registry.context import BuildContext
from torc.registry.kinds import CAMERAS, FOLDERS, KINDS, Kind, Traits, declarable
from torc.registry.loading import (
    blamed,
    is_shipped,
    load_part,
    make_part,
    part_lines,
    part_paths,
    shipped_paths,
    short_part_name,
)


class SortTraits(Traits):
    loud: bool = False
    again = None

    def end(self):
        return "ended"


KIND = Kind("sort of part", "sort", "tests", "act(thing)", SortTraits)


class Ours:
    def __init__(self, size=1):
        self.size = size

    def act(self, thing):
        return self.size, thing


class Greedy(Ours):
    def __init__(self, camera, size):
        super().__init__(size)
        self.camera = camera


class Idle:
    pass


class Shy(Ours):
    loud = "no"


class Breaks:
    def __init__(self):
        raise SystemExit(3)


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    """A package that registers a part."""

    class Point:
        def __init__(self, name, value):
            self.name, self.value = name, value

    points = {
        KIND.group: [Point("ours", f"{__name__}:Ours")],
        CAMERAS.group: [Point("zed", "somewhere:Else")],
    }
    monkeypatch.setattr(loading, "entry_points", lambda group: points.get(group, []))
    return lambda group, name, value: points.setdefault(group, []).append(Point(name, value))


def test_settings_are_arguments_and_the_context_is_given_by_name():
    context = BuildContext(camera=7, dof=6)
    assert make_part(KIND, "ours", {}, context).size == 1
    assert make_part(KIND, "ours", {"size": 3}, context).size == 3
    greedy = make_part(KIND, f"{__name__}:Greedy", {"size": 2}, context)
    assert (greedy.camera, greedy.size) == (7, 2)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (f"{__name__}:Idle", "needs a method `act\\(thing\\)`; Idle has none"),
        (f"{__name__}:Breaks", "could not be made: SystemExit: 3"),
        (f"{__name__}:Greedy", "does not take the options"),
        (f"{__name__}:Nobody", "has no 'Nobody'"),
        (f"{__name__}:KIND", "Kind, not a class"),
        (f"{__name__}:Shy", "`loud` is a str; it must be True or False"),
        ("no_such_module:Ours", "importing no_such_module failed"),
        (":Ours", "module:Class"),
        ("ors", "Did you mean 'ours'"),
    ],
)
def test_a_part_that_cannot_be_made_is_named_in_a_sentence(name, said):
    with pytest.raises(InputError, match=said) as caught:
        make_part(KIND, name)
    assert "sort of part" in str(caught.value).lower()


def test_a_misspelt_setting_names_the_nearest():
    with pytest.raises(UnknownNameError, match=r"'sort\.sise'\. Did you mean 'sort\.size'"):
        make_part(KIND, "ours", {"sise": 3})


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A working directory with somebody's files; one of them imports another one beside it."""
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
        part = make_part(KIND, name)
        assert part.act(None) == "deep"
        assert part_source(type(part)) == file_fingerprint(here / "deep down" / "mine.py")
    assert make_part(KIND, "mine.py:Mine").act(None) == "mine"
    assert load_part(KIND, "mine.py:Mine") is load_part(KIND, "mine.py:Mine")


def test_a_file_without_the_part_is_said_to_be_so(here):
    for name, said in (
        ("no/such.py:Mine", "there is no file 'no/such.py'. Looked for"),
        ("needs_more.py:Mine", "No module named 'no_such_library'"),
        ("needs_more.py:Mine", "No module named"),  # what failed once is not taken for loaded
        ("mine.py:Nobody", "has no 'Nobody'"),
        ("mine.py:", "must be written module:Class"),
    ):
        with pytest.raises(InputError, match=said):
            make_part(KIND, name)


def test_names_for_files_hold_no_directory():
    names = [short_part_name(n) for n in ("ours", "a.b:C", "x y/../b.py:C", "b:C")]
    assert names == ["ours", "a.b.C", "b.C", "b.C"]


def test_installed_packages_add_names_but_replace_none():
    assert part_paths(KIND) == {"ours": f"{__name__}:Ours"}
    assert part_paths(CAMERAS)["recorded"] == "torc.parts.cameras.recorded:PART"
    assert make_part(KIND, "ours").act(1) == (1, 1)
    with pytest.raises(UnknownNameError, match="ours"):
        make_part(KIND, "uors")


def test_a_package_of_parts_needs_one_entry_point(tmp_path, monkeypatch, installed):
    folder = tmp_path / "their_parts" / "cameras"
    folder.mkdir(parents=True)
    (folder / "old_webcam.py").write_text('"""A webcam."""\n\nPART = dict\n')
    (folder / "recorded.py").write_text("PART = list\n")
    monkeypatch.syspath_prepend(tmp_path)
    installed(FOLDERS, "theirs", "their_parts")
    assert load_part(CAMERAS, "old-webcam") is dict
    assert part_lines(CAMERAS)["old-webcam"] == "A webcam"
    assert part_paths(CAMERAS)["recorded"] == "torc.parts.cameras.recorded:PART"
    assert (is_shipped(CAMERAS, "recorded"), is_shipped(CAMERAS, "old-webcam")) == (True, False)


def test_names_and_help_import_no_part():
    before = set(sys.modules)
    assert all(part_lines(kind) for kind in KINDS if not kind.in_file)
    assert [m for m in set(sys.modules) - before if m.startswith("torc.parts.") and m.count(".") > 2] == []


SHIPPED = [(kind, name) for kind in KINDS for name in shipped_paths(kind)]


@pytest.mark.parametrize(("kind", "name"), SHIPPED, ids=lambda v: v if isinstance(v, str) else v.folder)
def test_every_shipped_part_can_be_loaded_and_has_a_line_of_help(kind, name):
    maker = load_part(kind, name)
    assert not isinstance(maker, type) or callable(getattr(maker, kind.method))
    assert 10 < len(part_lines(kind)[name]) < 90


def test_traits_of_a_part_that_does_not_inherit_have_the_defaults():
    part = Ours()
    assert KIND.traits(part).loud is False
    assert KIND.traits(part).end() == "ended"
    part.loud = True
    part.end = lambda: "own end"
    part.again = lambda: 7
    seen = KIND.traits(part)
    assert (seen.loud, seen.end(), seen.again()) == (True, "own end", 7)

    class Inherits(SortTraits):
        loud = True

    part = Inherits()
    assert KIND.traits(part) is part
    assert KIND.traits(Inherits).loud
    assert set(declarable(SortTraits)) == {"loud", "again", "end"}


def test_an_error_of_a_part_names_the_part_and_the_line():
    class PartError(TorcError):
        pass

    where = r"It failed with ZeroDivisionError.*test_loading\.py, line"
    with pytest.raises(PartError, match=where) as caught, blamed("It", PartError, "Ask its author."):
        _ = 1 / 0
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    with pytest.raises(InputError, match="as it is"), blamed("It", PartError, ""):
        raise InputError("as it is")
