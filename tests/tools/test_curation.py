"""The chosen problems are eligible, balanced over the cells, nearest to what is wanted, and named without a clash."""

from collections import Counter

from tools.curation import Candidate, Wanted, choose, named
from torc.objects.library import builtin_object_names
from torc.problems.problem import ObjectPlacement, Problem

MODELS = builtin_object_names()


def _problem(name="p", category="structured", count=9, hidden="hidden", target=0):
    models = (*MODELS[target:], *MODELS[:target])
    objects = tuple(
        ObjectPlacement(f"o{i}", models[i], (0.6, 0.0, 1.2), (1.0, 0, 0, 0)) for i in range(count)
    )
    return Problem(name, category, "", "o0", objects, origin={"hiddenness": hidden})


def _candidate(name="p", oracle=3, drops=0, random=(5, 5, 5), **facts):
    return Candidate(_problem(name, **facts), oracle, drops, random, ("o3", "o0"))


def _pool():
    """Twelve alike in every cell."""
    return [
        _candidate(
            f"{category[0]}{hidden[0]}{count}-{i}", category=category, hidden=hidden, count=count, target=i
        )
        for category in ("structured", "unstructured")
        for hidden in ("hidden", "partly")
        for count in (10, 13, 18)
        for i in range(12)
    ]


def test_cells_are_filled_evenly():
    chosen = choose(_pool(), Wanted(each=20))
    for category in ("structured", "unstructured"):
        mine = [c.problem for c in chosen if c.problem.category == category]
        assert len(mine) == 20
        assert Counter(p.origin["hiddenness"] for p in mine) == {"hidden": 10, "partly": 10}
        bands = Counter(len(p.objects) for p in mine)
        assert max(bands.values()) - min(bands.values()) <= 2


def test_the_nearest_come_first_and_targets_differ():
    near, far = _candidate("near"), _candidate("far", oracle=2, random=(8,))
    assert [c.problem.name for c in choose([far, near], Wanted(each=1))] == ["near"]
    same = _candidate("same", random=(5.5,))
    other = _candidate("other", random=(6,), target=7)
    assert [c.problem.name for c in choose([near, same, other], Wanted(each=2))] == ["near", "other"]


def test_names_are_free_and_facts_are_kept():
    chosen = [_candidate("x"), _candidate("y", category="unstructured"), _candidate("z", oracle=2)]
    problems = named(chosen, ["structured-01", "structured-03"])
    assert [p.name for p in problems] == ["structured-02", "unstructured-01", "structured-04"]
    assert problems[2].origin == {
        "hiddenness": "hidden",
        "oracle_picks": 2,
        "oracle_order": "o3, o0",
        "random_picks_median": 5.0,
    }
    assert [p.name for p in named(chosen[:1], [], "validation-")] == ["validation-structured-01"]
