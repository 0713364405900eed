"""The lab file: what it may say, and what it means."""

import numpy as np
import pytest

from torc.errors import InputError
from torc.robots.kinematics import tool0_poses
from torc_lab.devices import limits, planned_for
from torc_lab.lab_file import example_labs, load_lab

TEXT = example_labs()["sda10f-ros1"]


@pytest.fixture
def lab_of(tmp_path):
    def lab(text):
        path = tmp_path / "lab.yaml"
        path.write_text(text, encoding="utf-8")
        return load_lab(path)

    return lab


@pytest.mark.parametrize("name", example_labs())
def test_every_example_can_be_read(name, lab_of):
    lab = lab_of(example_labs()[name])
    assert lab.name == name
    assert lab.conditions.perception == "embedded"
    assert lab.safety.speed == 0.1


def test_settings_of_the_camera_and_the_stages_become_conditions(lab_of, tmp_path):
    (tmp_path / "calibration.yaml").write_text("", encoding="utf-8")
    changed = TEXT.replace("pose: workspace ", "pose: calibration.yaml\n  serial: '017'")
    lab = lab_of(changed.replace("depth: as-measured", "depth: sgbm\n  settings: {depth.full: true}"))
    assert lab.conditions.depth == "sgbm"
    assert dict(lab.conditions.settings) == {
        "camera.pose": str(tmp_path / "calibration.yaml"),
        "camera.serial": "017",
        "depth.full": True,
    }


def test_recorded_frames_beside_the_file_can_be_its_camera(lab_of, tmp_path):
    (tmp_path / "frames").mkdir()
    a, b = TEXT.index("camera:"), TEXT.index("pipeline:")
    lab = lab_of(f"{TEXT[:a]}camera:\n  driver: recorded\n  path: frames\n{TEXT[b:]}")
    assert lab.conditions.camera == "recorded"
    assert lab.conditions.settings["camera.path"] == str(tmp_path / "frames")


def test_the_usual_box_holds_table_bin_and_the_arm_at_rest(lab_of):
    lab = lab_of(TEXT)
    low, high = lab.safety.box_lower, lab.safety.box_upper
    flange = tool0_poses(lab.robot.arm, lab.robot.arm.rest_qpos[None])[0, :3, 3]
    for place in (flange, lab.workspace.drop_position, lab.workspace.table.center + np.array([0, 0, 0.1])):
        assert ((low < place) & (place < high)).all()
    assert low[2] <= lab.workspace.support_z_m
    own = lab_of(TEXT + "  box: {lower: [0, -1, 0.7], upper: [1, 1, 2]}\n")
    np.testing.assert_array_equal(own.safety.box_lower, [0, -1, 0.7])


def test_motions_are_planned_further_from_the_joint_limits_than_they_are_checked(lab_of):
    lab = lab_of(TEXT + "  margin_deg: 4\n")
    planned, checked, arm = planned_for(lab).arm, limits(lab), lab.robot.arm
    assert (arm.lower < checked.lower).all()
    assert (checked.lower < planned.lower).all()
    assert (planned.upper < checked.upper).all()
    np.testing.assert_allclose(checked.max_speed, 0.1 * arm.max_speed)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("format: torc-lab/1", "format: torc-lab/9", "format"),
        ("driver: ros\n", "driver: rso\n", "arm driver 'rso'"),
        ("  ros: 1", "  ros: 1\n  colour: red", "colour"),
        ("  ros: 1", "  ros: 7", "ros"),
        ("  address: /dev/ttyUSB0", "  adress: /dev/ttyUSB0", "adress"),
        ("speed: 0.1", "speed: 3", "safety.speed"),
        ("speed: 0.1", "box: {lower: [1, 1, 1], upper: [0, 2, 2]}", "lower"),
        ("perception: embedded", "preception: embedded", "preception"),
        ("robot: sda10f_2f85", "robot: unknown", "unknown"),
        ("pipeline:", "- pipeline", "YAML"),
    ],
)
def test_faults_of_a_file_are_told_with_their_place(old, new, told, lab_of):
    assert old in TEXT
    with pytest.raises(InputError, match=told):
        lab_of(TEXT.replace(old, new))


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="torc lab example"):
        load_lab(tmp_path / "no.yaml")


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path):
    (tmp_path / "lab.yaml").write_bytes(b"\xef\xbb\xbf" + TEXT.encode("utf-8"))
    assert load_lab(tmp_path / "lab.yaml").name == "sda10f-ros1"
