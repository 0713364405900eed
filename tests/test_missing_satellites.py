"""Without satellites their commands and parts say how to get them, and what was recorded with them still loads."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest

from tests.helpers.fake_bench import made_up_table
from tests.helpers.fake_trial import play_fake_trial
from tests.helpers.torc_command import run_torc
from torc.benchmark.reading import read_table
from torc.benchmark.report.pages import Section
from torc.benchmark.report.writing import _registered_sections, write_report
from torc.benchmark.rows import REAL
from torc.errors import MissingDependencyError, PartError
from torc.pipeline.planners import make_planner
from torc.registry.kinds import KINDS
from torc.registry.loading import load_part
from torc.satellites import SATELLITES
from torc.specs.conditions import Conditions
from torc.specs.trial import PlannerSpec, TrialSpec
from torc.trials.recorded import read_trial
from torc.web.shelf import Shelf

COMMANDS = [(name, s.extra) for s in SATELLITES for name in s.commands]
PARTS = [
    (g, name, extra) for s in SATELLITES for g, names in s.parts.items() for name, extra in names.items()
]


@pytest.fixture
def registered(monkeypatch):
    """What packages have registered: nothing but what a test puts here, by group and name."""
    points: dict = {}

    def entry_points(group):
        found = points.get(group, {}).items()
        return [SimpleNamespace(name=name, value="theirs:It", load=load) for name, load in found]

    monkeypatch.setattr("torc.registry.loading.entry_points", entry_points)
    return points


@dataclass(frozen=True)
class Greet:
    """Greet."""

    def run(self):
        return print("hello") or 0


@pytest.mark.parametrize(("name", "extra"), COMMANDS)
def test_a_command_says_how_to_get_it(name, extra, registered, capsys):
    code, _, err = run_torc(name, "--help", capsys=capsys)
    assert code == 1
    assert f"scripts/setup {extra} " in err
    assert f"'torc-retrieval[{extra}]'" in err


@pytest.mark.parametrize(("group", "name", "extra"), PARTS)
def test_a_part_says_how_to_get_it(group, name, extra, registered):
    (kind,) = (kind for kind in KINDS if kind.group == group)
    with pytest.raises(MissingDependencyError, match=f"scripts/setup {extra} "):
        load_part(kind, name)


def test_help_names_them_in_a_line(registered, capsys):
    code, out, _ = run_torc("--help", capsys=capsys)
    assert code == 0
    assert all(name in out.partition("Not installed: ")[2] for name, _ in COMMANDS)


def test_any_package_can_add_a_command(registered, capsys):
    registered["torc.commands"] = {"greet": lambda: ("say hello", Greet), "run": lambda: ("no", Greet)}
    assert run_torc("greet", capsys=capsys)[:2] == (0, "hello\n")
    _, out, _ = run_torc("--help", capsys=capsys)
    assert "say hello" in out
    assert "one retrieval in simulation" in out


@pytest.mark.parametrize("entry", [lambda: 1 / 0, lambda: Greet, lambda: ("say hello", "Greet")])
def test_a_broken_command_breaks_no_other(registered, entry, capsys):
    registered["torc.commands"] = {"greet": entry}
    code, _, err = run_torc("greet", capsys=capsys)
    assert code == 2
    assert "'greet'" in err
    assert run_torc("--help", capsys=capsys)[0] == 0
    assert run_torc("robots", "--help", capsys=capsys)[0] == 0


def test_what_was_recorded_with_their_parts_still_loads(tmp_path, registered):
    conditions = Conditions(
        perception="sam3", depth="network", grasps="graspgenx", motion="curobo", camera="realsense"
    )
    spec = TrialSpec("boxes", PlannerSpec("dg-select"), 0, conditions)
    trial = play_fake_trial(spec, tmp_path / "runs" / "boxes", make_planner("dg-select")).directory
    assert read_trial(trial).spec == spec
    (row,) = read_table(tmp_path / "runs").rows
    assert row.completed
    pytest.importorskip("matplotlib")
    page = write_report([tmp_path / "runs"], tmp_path / "report").page.read_text(encoding="utf-8")
    assert "sam3" in page
    (key,) = Shelf(tmp_path / "runs").directories()
    assert Shelf(tmp_path / "runs").read(key).spec == spec


def test_the_report_of_real_trials_says_what_is_missing(registered):
    table = made_up_table(mine=[[3, 4]])
    assert _registered_sections(table) == []
    real = replace(table, rows=tuple(replace(row, category=REAL) for row in table.rows))
    (section,) = _registered_sections(real)
    assert "scripts/setup lab" in section.blocks[0]


def test_any_package_can_add_a_section_to_the_report(registered):
    registered["torc.report_sections"] = {
        "mine": lambda: lambda table: [Section("Mine", [str(len(table.rows))])]
    }
    assert _registered_sections(made_up_table(mine=[[3, 4]])) == [Section("Mine", ["2"])]
    registered["torc.report_sections"] = {"mine": lambda: lambda table: 1 / 0}
    with pytest.raises(PartError, match="section 'mine' failed with ZeroDivisionError"):
        _registered_sections(made_up_table(mine=[[3, 4]]))
