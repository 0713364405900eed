"""A planner that takes hold of the simulation plays like any other, but does not compete."""

import pytest

from torc.benchmark.reading import read_table
from torc.benchmark.report.ranking import rank, verdict
from torc.benchmark.report.tables import ranking_table, references_table
from torc.episode.trial import run_trial
from torc.records import Decision
from torc.specs.trial import TrialSpec


class Honest:
    """Takes the first object that can be grasped."""

    name = "honest"

    def decide(self, context, rng):
        graspable = context.report.graspable_ids
        return Decision(graspable[0] if graspable else None, "the first")


class Cheat(Honest):
    """The same, but it looks where the target is."""

    name = "cheat"

    def attach(self, simulation):
        self.simulation = simulation

    def decide(self, context, rng):
        share = self.simulation.truth().visibility.pixels_alone[0]
        return Decision(super().decide(context, rng).object_id, f"the target has {share} pixels")


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """A directory with a trial of each."""
    root = tmp_path_factory.mktemp("played")
    for planner in (Cheat, Honest):
        spec = TrialSpec.of("structured-04", f"{__name__}:{planner.__name__}", max_picks=1)
        run_trial(spec, root / planner.name, say=lambda text: None)
    return root


def test_a_cheating_plugin_is_listed_as_a_reference(played):
    table = read_table(played)
    standings = rank(table)
    assert [s.planner for s in standings] == [f"{__name__}:Honest", f"{__name__}:Cheat"]
    # It costs the same, and would stand first by its name.
    assert standings[0].cost.value == standings[1].cost.value
    assert [row[1] for row in ranking_table(standings, table).rows] == [f"{__name__}:Honest"]
    assert [row[0] for row in references_table(standings, table).rows] == [f"{__name__}:Cheat"]
    assert verdict(table, standings).planner == f"{__name__}:Honest"
