"""A trial's spec: to the disk and back, settings of stages, and what conditions are called."""

import json
import re
from dataclasses import dataclass, field

import pytest

from torc.errors import InputError, UnknownNameError
from torc.pipeline.building import build_system, make_stage, sources
from torc.registry.context import BuildContext
from torc.registry.settings import arguments, changed
from torc.specs.conditions import Conditions
from torc.specs.spec_files import from_plain, to_plain
from torc.specs.trial import PlannerSpec, TrialSpec
from torc.vlm.config import VlmConfig
from torc.vlm.picture_config import PictureConfig
from torc.vlm.prices import Prices
from torc.vlm.prompt import Example, Prompt

ASKED = VlmConfig(
    *("gemini", "robot-1"),
    thinking="low",
    picture=PictureConfig("outlines", True, 24, 1024),
    prompt=Prompt("mine", "$target?", "Be brief.", examples=(Example("?", "!"),)),
    prices=Prices(0.3, 2.5, "EUR"),
)
FULL = TrialSpec(
    "mine/pile.yaml",
    PlannerSpec("vlm-select", ASKED, {"asks": 2}),
    7,
    Conditions(noise=True, grasps="a/b.py:C", settings={"occlusion.smooth_px": 3, "bets.costs": [1, 2]}),
)


@dataclass(frozen=True)
class Inner:
    width_m: float = 0.1
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outer:
    inner: Inner = field(default_factory=Inner)
    count: int = 3
    spare: Inner | None = field(default_factory=Inner)

    def __post_init__(self):
        if self.count < 0:
            raise InputError("count must not be negative.")

    @classmethod
    def rough(cls):
        return cls(Inner(5.0))


class Configured:
    def __init__(self, config: Outer | None = None) -> None:
        self.config = config or Outer()

    def plan(self, scene, volume, rng):
        return None


class Plain(Configured):
    def __init__(self, gripper, speed=1.0):
        self.gripper, self.speed = gripper, speed


def test_a_spec_survives_the_disk():
    recorded = from_plain(json.loads(json.dumps(to_plain(FULL, {"grasps": "abcdef123456"}))), "here")
    assert recorded.spec == FULL
    assert recorded.sources == {"grasps": "abcdef123456"}
    assert (
        recorded.conditions_text == "grasps b.C (abcdef12), noise, bets.costs [1, 2], occlusion.smooth_px 3"
    )


def test_what_is_no_spec_is_refused():
    seed, noise = {"planner": "random", "seed": "many"}, {"conditions": {"noise": "much"}}
    flat = ({"problem": "x"}, {"problem": "x", **seed})
    for data in ([], {"format": "torc-trial-spec/9"}, *flat, to_plain(FULL, {}) | noise):
        with pytest.raises(InputError, match="here"):
            from_plain(data, "here")


def test_settings_reach_any_depth_and_are_checked():
    assert changed(Outer(), {"inner.width_m": 1, "count": "4"}, "stage") == Outer(Inner(1.0), 4)
    assert changed(Outer(), {"inner.names": ["a", "b"]}, "stage").inner.names == ("a", "b")
    assert changed(Outer(), {"spare": None}, "stage").spare is None
    with pytest.raises(UnknownNameError, match=r"Did you mean 'stage.inner.width_m'"):
        changed(Outer(), {"inner.width": 1}, "stage")
    with pytest.raises(InputError, match=r"stage.count cannot be 'x'"):
        changed(Outer(), {"count": "x"}, "stage")
    with pytest.raises(InputError, match="count must not be negative"):
        changed(Outer(), {"count": -1}, "stage")
    with pytest.raises(InputError, match=r"has settings of its own: stage.inner.width_m, stage.inner.names"):
        changed(Outer(), {"inner": 3}, "stage")


def test_a_part_gets_its_settings_as_its_config_or_as_arguments():
    assert arguments(Configured, {"inner.width_m": 2.0}, "grasps") == {"config": Outer(Inner(2.0))}
    assert arguments(Configured, {}, "grasps") == {}
    assert arguments(Configured, {"count": 1}, "grasps", rough=True) == {"config": Outer(Inner(5.0), 1)}
    assert arguments(Configured, {}, "grasps", rough=True) == {"config": Outer(Inner(5.0))}
    assert arguments(Plain, {"speed": 2.0}, "grasps", rough=True) == {"speed": 2.0}


def test_a_part_of_ones_own_is_made_with_its_settings():
    one = Conditions(grasps=f"{__name__}:Plain", settings={"grasps.speed": 0.5})
    part = make_stage(one, "grasps", BuildContext(gripper="the gripper", support_z_m=1.0))
    assert (part.speed, part.gripper) == (0.5, "the gripper")
    with pytest.raises(UnknownNameError, match=r"Did you mean 'grasps\.speed'"):
        make_stage(
            Conditions(grasps=f"{__name__}:Plain", settings={"grasps.sped": 1}),
            "grasps",
            BuildContext(gripper=1),
        )
    assert set(sources(one)) == {"grasps"}
    assert sources(Conditions()) == {}


def test_the_shipped_parts_take_settings():
    settings = {"noise.dropout": 0.1, "occlusion.smooth_px": 5, "perception.min_pixels": 20}
    settings |= {"grasps.candidates.max_blocked": 7, "motion.max_grasps": 2}
    pipeline = build_system(Conditions(noise=True, settings=settings)).pipeline
    assert (pipeline.noise.dropout, pipeline.occlusion.smooth_px) == (0.1, 5)
    assert pipeline.perception.config.min_pixels == 20
    assert pipeline.perception.config.rim_px == 2  # as for any real camera
    assert pipeline.grasp_planner.config.candidates.max_blocked == 7
    assert pipeline.motion.max_grasps == 2


def test_settings_of_nothing_are_refused():
    for settings, told in (
        ({"oclusion.smooth_px": 3}, "Did you mean 'occlusion.'"),
        ({"occlusion": 3}, "Unknown stage"),
        ({"noise.dropout": 0.1}, "add --noise"),
        ({"occlusion.smooth_px": 4}, "must be 0, 3 or 5"),
    ):
        with pytest.raises(InputError, match=told):
            build_system(Conditions(settings=settings))


def test_only_what_differs_from_the_defaults_counts():
    assert Conditions().facts({}) == {}
    own = Conditions(robot="a/mine.yaml", noise=True)
    assert own.facts({"robot": "a1"}) == {"robot": "a1", "noise": True}
    assert Conditions(max_picks=7).text({}) == ""
    bold = Conditions(min_score=0.0, settings={"motion.max_grasps": 2})
    assert bold.text({}) == "min_score 0, motion.max_grasps 2"


def test_a_trial_has_a_name_of_its_own():
    assert TrialSpec.of("structured-01").default_name == "structured-01-dg-select-0"
    other = TrialSpec.of("structured-01", "random", 3, grasps="a/b.py:C", settings={"occlusion.smooth_px": 3})
    assert other.default_name == "structured-01-random-b.C-smooth_px=3-3"
    with pytest.raises(InputError, match="--seed"):
        TrialSpec.of("structured-01", seed=-1)


def test_pictures_and_prompts_that_are_not_torcs_own_stand_in_labels_and_names():
    plain = PlannerSpec("vlm-select", VlmConfig("gemini", "robot-1"))
    assert plain.label == "vlm-select[robot-1]"
    words = f"outlines, plain beside, crop 24, 1024 px, prompt mine {ASKED.prompt.digest[:8]}"
    assert PlannerSpec("vlm-select", ASKED).label == f"vlm-select[robot-1, {words}]"
    name = TrialSpec("structured-01", PlannerSpec("vlm-select", ASKED)).default_name
    assert re.fullmatch(r"[\w.=-]+", name)
    assert "outlines" in name
