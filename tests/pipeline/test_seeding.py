"""Random streams are independent by stage and pick."""

from torc.pipeline.seeding import stage_rng


def _draw(*key):
    return stage_rng(*key).integers(0, 2**60)


def test_same_key_same_stream_other_key_other_stream():
    keys = [(seed, pick, stage) for seed in (0, 1) for pick in (0, 1) for stage in ("grasps", "motion")]
    draws = [_draw(*key) for key in keys]
    assert draws == [_draw(*key) for key in keys]
    assert len(set(draws)) == len(keys)
