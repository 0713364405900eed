"""`torc lab` and `torc retrieve` as a user meets them, before a device is there."""

import json

import pytest

from tests.helpers.torc_command import run_torc
from torc_lab.cli.lab import _obey
from torc_lab.lab_file import example_labs


@pytest.fixture
def lab_file(tmp_path):
    path = tmp_path / "lab.yaml"
    text = example_labs()["sda10f-ros1"].replace("192.168.1.10:9090", "127.0.0.1:9")
    path.write_text(text.replace("/dev/ttyUSB0", "127.0.0.1:9"), encoding="utf-8")
    return path


def test_examples_are_listed_and_printed(capsys):
    code, out, _ = run_torc("lab", "example", capsys=capsys)
    assert code == 0
    assert all(name in out for name in example_labs())
    code, out, _ = run_torc("lab", "example", "sda10f-simple-message", capsys=capsys)
    assert code == 0
    assert out == example_labs()["sda10f-simple-message"]
    code, _, err = run_torc("lab", "example", "sda10f", capsys=capsys)
    assert code == 2
    assert "sda10f-ros1" in err


def test_checking_goes_on_to_the_other_devices(lab_file, capsys):
    code, out, _ = run_torc("lab", "check", lab_file, "--json", capsys=capsys)
    assert code == 1
    found = [json.loads(line) for line in out.splitlines()]
    assert [f["device"] for f in found] == ["arm", "gripper", "camera"]
    assert not any(f["good"] for f in found)


def test_a_target_that_nobody_can_know_is_refused_before_anything_is_reached(lab_file, capsys):
    code, _, err = run_torc("retrieve", "--lab", lab_file, capsys=capsys)
    assert code == 2
    assert "--reference" in err
    code, _, err = run_torc("retrieve", "--lab", lab_file, "--target", "a mug", capsys=capsys)
    assert code == 2
    assert "by pictures, not by words" in err


def test_a_robot_that_cannot_be_reached_leaves_nothing(lab_file, tmp_path, capsys):
    from PIL import Image

    picture = tmp_path / "mug.png"
    Image.new("RGB", (300, 300), (200, 30, 30)).save(picture)
    out = tmp_path / "runs" / "trial"
    code, _, err = run_torc(
        "retrieve", "--lab", lab_file, "--reference", picture, "--out", out, capsys=capsys
    )
    assert code == 1
    assert "cannot be reached" in err
    assert not out.parent.exists()


def test_the_board_is_written(tmp_path, capsys):
    code, _, _ = run_torc("lab", "board", "--out", tmp_path / "board.png", capsys=capsys)
    assert code == 0
    assert (tmp_path / "board.png").exists()
    code, _, err = run_torc("lab", "board", "--square-m", "30", capsys=capsys)
    assert code == 2
    assert "Sizes are in metres" in err


class Twins:
    """What a line does to them is written down."""

    def __init__(self):
        self.halted, self.done = [], []
        self.arm = self.world = self

    def halt(self, **changed):
        self.halted.append(changed)

    def reset(self):
        self.done.append("reset")

    def disturb(self):
        self.done.append("disturb")


def test_faults_are_typed_and_what_is_none_is_said(capsys):
    twins = Twins()
    _obey(twins, ["e-stop\n", "\n", " TEACH \n", "fire\n", "disturb\n", "reset\n"])
    assert twins.halted == [{"e_stopped": 1}, {"mode": 1}]
    assert twins.done == ["disturb", "reset"]
    assert "'fire' is not one of e-stop" in capsys.readouterr().out


def test_a_scene_is_told_what_it_lacks_before_anything_is_reached(lab_file, tmp_path, capsys):
    scene = tmp_path / "cups"
    code, _, err = run_torc("lab", "scene", scene, "--lab", lab_file, capsys=capsys)
    assert code == 2
    assert "--reference" in err
    code, _, err = run_torc("lab", "scene", scene, "--lab", lab_file, "--mark", "1,x", capsys=capsys)
    assert code == 2
    assert "COLUMN,ROW" in err
    code, _, err = run_torc(
        "lab", "scene", tmp_path / "my cups", "--lab", lab_file, "--mark", "1,2", capsys=capsys
    )
    assert code == 2
    assert "letters, digits" in err
    scene.mkdir()
    (scene / "other.txt").write_text("mine")
    code, _, err = run_torc("lab", "scene", scene, "--lab", lab_file, "--mark", "1,2", capsys=capsys)
    assert code == 2
    assert "is no scene" in err
    assert (scene / "other.txt").exists()
    code, _, err = run_torc(
        "lab", "scene", tmp_path / "new", "--lab", lab_file, "--mark", "1,2", capsys=capsys
    )
    assert code == 1
    assert "cannot be reached" in err
    assert not (tmp_path / "new").exists()


def test_a_bench_without_scenes_or_with_wrong_numbers_leaves_nothing(lab_file, tmp_path, capsys):
    out = tmp_path / "real"
    for wrong, said in (
        (("--scenes", tmp_path / "none"), "holds no scene"),
        (("--scenes", tmp_path, "--limit", "0"), "--limit"),
        (("--scenes", tmp_path, "--threshold", "2"), "--threshold"),
    ):
        code, _, err = run_torc("lab", "bench", "--lab", lab_file, "--out", out, *wrong, capsys=capsys)
        assert code == 2
        assert said in err
    assert not out.exists()
