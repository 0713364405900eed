"""Specs take NumPy's numbers as Python's; True and False are not numbers."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from torc.errors import InputError
from torc.exports.exporting import ExportSpec
from torc.specs.conditions import Conditions
from torc.specs.trial import PlannerSpec, TrialSpec
from torc.vlm.config import VlmConfig

PAIRS = [
    (lambda n, x, b: TrialSpec.of("p", seed=n(3), max_picks=n(2), friction=x(0.5), noise=b(True))),
    (lambda n, x, b: Conditions(min_score=x(0.5), settings={"occlusion.smooth_px": n(3)})),
    (lambda n, x, b: PlannerSpec("belief", settings={"planner.a": x(0.5)}, outside_view=b(False))),
    (
        lambda n, x, b: VlmConfig(
            "openai", "m", temperature=x(0.5), max_output_tokens=n(9), retries=n(2), seeded=b(True)
        )
    ),
    (lambda n, x, b: ExportSpec("sft", test_share=x(0.5), every=b(True))),
]


@pytest.mark.parametrize("make", PAIRS)
@pytest.mark.parametrize("whole", [np.int64, np.uint8])
@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_numpys_numbers_give_the_same_record_as_pythons(make, whole, real):
    plain, from_numpy = make(int, float, bool), make(whole, real, np.bool_)
    assert from_numpy == plain
    assert json.dumps(asdict(from_numpy)) == json.dumps(asdict(plain))


@pytest.mark.parametrize(
    "make",
    [
        lambda: TrialSpec.of("p", seed=True),
        lambda: TrialSpec.of("p", seed=1.5),
        lambda: TrialSpec.of("p", seed="1"),
        lambda: TrialSpec.of("p", seed=None),
        lambda: TrialSpec.of("p", max_picks=np.True_),
        lambda: Conditions(friction=True),
        lambda: Conditions(friction=float("nan")),
        lambda: Conditions(noise=1),
        lambda: VlmConfig("openai", "m", temperature=False),
        lambda: VlmConfig("openai", "m", retries=np.float64(2)),
    ],
)
def test_what_is_not_a_number_is_refused(make):
    with pytest.raises(InputError, match="it must be"):
        make()
