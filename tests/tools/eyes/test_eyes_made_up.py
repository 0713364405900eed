"""Made-up objects: sound ones, of joined parts, each different from the others."""

from pathlib import Path

import numpy as np
import pytest

from tools.eyes.made_up import KINDS, made_up, make_up
from torc.objects.library import load_stored
from torc.objects.object_files import check_model


@pytest.mark.parametrize("seed", range(24))
def test_a_made_up_object_is_sound_and_its_surface_agrees_with_its_pieces(seed):
    model = made_up("made_up_0", "made_up", np.random.default_rng(seed))
    check_model(model, Path("made_up_0"))
    ways = np.random.default_rng(0).standard_normal((60, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    reach = np.concatenate([v.vertices for v in model.visuals]) @ ways.T
    assert np.abs(reach.max(axis=0) - model.support(ways)).max() < 0.004


@pytest.mark.parametrize("seed", range(24))
def test_its_pieces_are_joined(seed):
    pieces = made_up("made_up_0", "made_up", np.random.default_rng(seed)).pieces
    boxes = np.stack([p.bounds for p in pieces])
    near = (boxes[:, None, 0] <= boxes[None, :, 1] + 1e-3).all(-1)
    joined = {0}
    for _ in pieces:
        joined |= {int(j) for i in joined for j in np.flatnonzero(near[i] & near[:, i])}
    assert joined == set(range(len(pieces)))


def test_a_store_holds_different_ones_of_many_kinds_and_is_made_once(tmp_path):
    names = make_up(tmp_path, 6, 1)
    times = {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*.yaml")}
    assert make_up(tmp_path, 6, 1) == names
    assert times == {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*.yaml")}
    models = [load_stored(tmp_path / n) for n in names]
    assert len({m.size_m for m in models}) == len({m.kind for m in models}) == 6 < KINDS
