"""The report runs on a small set and says what was asked for."""

from training_trials import make_trials

from tools.grasp_model.dataset import Policy
from tools.grasp_model.report import write_report
from tools.grasp_model.train import TrainConfig

QUICK = TrainConfig(trees=15, leaves=5, learning_rate=0.3, folds=3)


def test_report_on_a_small_set(tmp_path):
    train = make_trials(700, seed=1, scenes=60)
    held_out = make_trials(300, seed=2, scenes=20, collection=9)
    held_out.policy[:] = [Policy.TOP_MODEL, Policy.TOP_HAND, Policy.RANDOM] * 100
    out, picture = tmp_path / "docs" / "grasp_model.md", tmp_path / "docs" / "img" / "curve.png"
    write_report(train, held_out, out, picture, QUICK)
    text = out.read_text()
    for part in (
        "Calibration",
        "Learning curve",
        "unseen kinds",
        "piles",
        "best object of each snapshot",
        "extent",
    ):
        assert part in text
    assert "nan" not in text
    assert picture.read_bytes().startswith(b"\x89PNG")
