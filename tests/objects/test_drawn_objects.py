"""The shipped objects are what `tools/objects` draws: if this fails, run `python -m tools.objects`."""

from pathlib import Path

import numpy as np
import pytest

from torc.objects.library import builtin_object_names, load_object
from torc.objects.models import ObjectModel


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> dict[str, ObjectModel]:
    """All objects of the catalogue, drawn now, in its order."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    from tools.objects.catalogue import ALL_KINDS
    from tools.objects.drawing import draw

    return {variant.name: draw(kind, variant) for kind in ALL_KINDS for variant in kind.variants}


def test_the_drawing_code_draws_what_is_shipped(drawn: dict[str, ObjectModel]) -> None:
    """Up to the last bits, which depend on the processor, and the pixels of letters, which depend on Pillow."""
    assert tuple(drawn) == builtin_object_names()
    for name, new in drawn.items():
        shipped = load_object(name)
        for field in ("kind", "description", "mass_kg", "rolls", "friction", "held_out"):
            assert getattr(new, field) == getattr(shipped, field)
        assert [p.kind for p in new.pieces] == [p.kind for p in shipped.pieces]
        for p, q in zip(new.pieces, shipped.pieces):
            numbers = [[*r.size, *r.position, *r.wxyz, r.relative_density] for r in (p, q)]
            np.testing.assert_allclose(*numbers, atol=1e-9)
            if p.vertices is not None:
                np.testing.assert_allclose(p.vertices, q.mesh_vertices, atol=1e-9)
        assert len(new.visuals) == len(shipped.visuals)
        for v, w in zip(new.visuals, shipped.visuals):
            np.testing.assert_allclose(v.vertices, w.vertices, atol=1e-9)
            np.testing.assert_array_equal(v.faces, w.faces)
            np.testing.assert_allclose(v.rgba, w.rgba, atol=1e-9)
            assert np.shape(v.texture) == np.shape(w.texture)
