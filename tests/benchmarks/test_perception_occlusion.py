"""The benchmark of one look runs, and sees all objects."""

from benchmarks.perception_occlusion import close_up, measure


def test_a_close_up_is_measured(capsys):
    measure("close-up", close_up(), 1)
    assert "close-up: 12 objects" in capsys.readouterr().out
