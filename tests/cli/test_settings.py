"""Settings of stages on the command line, and experiments as files."""

import json

import pytest

from tests.helpers.fake_episode import ScriptedPlanner
from tests.helpers.fake_trial import play_fake_trial
from tests.helpers.torc_command import run_torc
from torc.cli.bench import BenchCommand
from torc.cli.experiments import read_experiment
from torc.cli.main import parse
from torc.errors import InputError
from torc.specs.conditions import Conditions
from torc.specs.trial import TrialSpec


def test_any_setting_of_a_stage_is_an_option():
    command = parse(
        [
            *("run", "structured-01", "--occlusion.smooth-px", "3", "--noise", "--grasps.depths=[0.1, 0.2]"),
            *("--simulation.execution.free_guard", "null", "--planner.relations.closeness_m", "0.01"),
        ]
    )
    assert command.problem == "structured-01"
    assert command.conditions == Conditions(
        noise=True,
        settings={
            "occlusion.smooth_px": 3,
            "grasps.depths": [0.1, 0.2],
            "simulation.execution.free_guard": None,
        },
    )
    assert command.planner_settings == {"relations.closeness_m": 0.01}


def test_a_setting_needs_a_value_and_a_command_that_takes_it():
    with pytest.raises(InputError, match=r"--occlusion.smooth_px needs a value"):
        parse(["run", "--occlusion.smooth_px"])
    with pytest.raises(InputError, match="takes no settings of stages"):
        parse(["view", "runs", "--occlusion.smooth_px", "3"])
    with pytest.raises(InputError, match="takes no settings of a planner"):
        parse(["bench", "--out", "x", "--planner.relations.closeness_m", "1"])


def test_settings_are_listed_with_their_defaults(capsys):
    code, out, _ = run_torc("settings", "occlusion", capsys=capsys)
    assert code == 0
    assert "--occlusion.smooth-px" in out
    assert all(line.startswith("--occlusion.") for line in out.splitlines())
    code, out, _ = run_torc("settings", capsys=capsys)
    assert "--motion.cartesian.step-m" in out
    code, _, err = run_torc("settings", "oclusion", capsys=capsys)
    assert code == 2
    assert "Did you mean 'occlusion'" in err


def test_an_experiment_file_sets_what_is_not_an_option(tmp_path):
    path = tmp_path / "experiment.yaml"
    path.write_text(
        "problems: [validation, structured-01]\nplanners: [random, {name: dg-select, settings: {a.b: 1}}]\n"
        "repeats: 3\nsweep: {noise: [true, false]}\nconditions: {robot: mine.yaml, settings: {motion.max_grasps: 2}}\n"
    )
    command = parse(["bench", str(path), "--out", "x", "--repeats", "5", "--occlusion.smooth-px", "3"])
    assert isinstance(command, BenchCommand)
    assert (command.problems, command.repeats) == ("validation,structured-01", 5)
    assert command.own_planners == (("random", {}), ("dg-select", {"a.b": 1}))
    assert command.sweep == ("noise=true,false",)
    assert command.conditions == Conditions(
        robot="mine.yaml", settings={"motion.max_grasps": 2, "occlusion.smooth_px": 3}
    )


def test_what_is_wrong_in_an_experiment_is_named(tmp_path):
    for text, told in (
        ("planers: [random]", "planers"),
        ("repeats: 0", "repeats"),
        ("conditions: {nois: true}", "conditions.nois"),
        ("- 1", "holds no experiment"),
    ):
        (tmp_path / "e.yaml").write_text(text)
        with pytest.raises(InputError, match=told):
            read_experiment(tmp_path / "e.yaml")


@pytest.fixture(scope="module")
def trial(tmp_path_factory):
    directory = tmp_path_factory.mktemp("runs") / "boxes"
    play_fake_trial(TrialSpec.of("boxes", "scripted"), directory, ScriptedPlanner([1, 0]))
    return directory


def test_it_says_what_it_wrote(trial, tmp_path, capsys):
    code, out, _ = run_torc("export", trial, "--out", tmp_path / "a", "--test-share", "0", capsys=capsys)
    assert code == 0
    assert out.splitlines()[0] == "train  2 examples"
    code, out, _ = run_torc(
        "export", trial, "--out", tmp_path / "b", "--test-share", "0", "--json", capsys=capsys
    )
    assert code == 0
    assert json.loads(out) == json.loads((tmp_path / "b" / "export.json").read_text())
    assert json.loads(out)["examples"] == {"train": 2, "test": 0}


def test_what_cannot_be_done_is_bad_input_with_a_remedy(trial, tmp_path, capsys):
    cases = {
        "is no export, so nothing replaces it": (trial, "--out", trial, "--overwrite"),
        "--trajectory": (trial, "--format", "lerobot", "--out", tmp_path / "out"),
        "oracle": (trial, "--format", "pairs", "--out", tmp_path / "out"),
        "nowhere' is not a directory": (tmp_path / "nowhere", "--out", tmp_path / "out"),
        "is not a directory": (trial / "events.jsonl", "--out", tmp_path / "out"),
        "from 0 to 1": (trial, "--out", tmp_path / "out", "--test-share", "2"),
    }
    for word, arguments in cases.items():
        code, out, err = run_torc("export", *arguments, capsys=capsys)
        assert (code, out) == (2, "")
        assert word in err
    assert list(tmp_path.iterdir()) == []
