"""The shipped robot, loaded once; and a second one, as a user would write it.

The second has six joints, no spherical shoulder, and a gripper whose fingers slide.
"""

from collections.abc import Callable
from pathlib import Path

import pytest

MJCF = """
<mujoco model="other">
  <compiler angle="radian" autolimits="true"/>
  <worldbody>
    <body name="stand" pos="0.1 0.2 0.3">
      <geom name="stand" type="cylinder" size="0.08 0.05"/>
      <body name="a1" pos="0 0 0.1"><joint name="a1" axis="0 0 1" range="-6.2 6.2"/>
        <geom type="capsule" size="0.06" fromto="0 0 0 0 0 0.15"/>
        <body name="a2" pos="0 0.1 0.05"><joint name="a2" axis="0 1 0" range="-2 2"/>
          <geom type="capsule" size="0.05" fromto="0 0 0 0 0 0.4"/>
          <body name="a3" pos="0 -0.02 0.4" euler="0 0.4 0">
            <joint name="a3" axis="0 1 0" range="-2.5 2.5" pos="0 0 0.01"/>
            <geom type="capsule" size="0.045" fromto="0 0 0 0 0 0.35"/>
            <body name="a4" pos="0 0.05 0.35"><joint name="a4" axis="0 1 0" range="-3 3"/>
              <geom type="sphere" size="0.05"/>
              <body name="a5" pos="0 0.08 0"><joint name="a5" axis="0 0 1" range="-3 3"/>
                <geom type="sphere" size="0.05"/>
                <body name="a6" pos="0 0 0.09"><joint name="a6" axis="0 1 0" range="-3 3"/>
                  <geom type="cylinder" size="0.04 0.02"/>
                  <body name="hand" pos="0 0.05 0" euler="-1.5707963267948966 0 0">
                    <site name="flange"/>
                    <geom type="box" size="0.06 0.03 0.03" pos="0 0 0.03"/>
                    <body name="left" pos="-0.05 0 0.06">
                      <joint name="slide_left" type="slide" axis="1 0 0" range="0 0.05"/>
                      <geom name="left_pad" type="box" size="0.005 0.01 0.02" pos="-0.005 0 0.02"/>
                      <site name="left_tip" pos="0 0 0.04"/>
                    </body>
                    <body name="right" pos="0.05 0 0.06">
                      <joint name="slide_right" type="slide" axis="-1 0 0" range="0 0.05"/>
                      <geom name="right_pad" type="box" size="0.005 0.01 0.02" pos="0.005 0 0.02"/>
                      <site name="right_tip" pos="0 0 0.04"/>
                    </body>
                  </body>
                </body>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="slide_left" joint2="slide_right" polycoef="0 1 0 0 0"/></equality>
  <actuator>
    <position name="m1" joint="a1"/><position name="m2" joint="a2"/><position name="m3" joint="a3"/>
    <position name="m4" joint="a4"/><position name="m5" joint="a5"/><position name="m6" joint="a6"/>
    <general name="grip" joint="slide_right" ctrlrange="0 255" gainprm="0.2" biastype="affine" biasprm="0 -1000 0"/>
  </actuator>
</mujoco>
"""

YAML = """
format: torc-robot/1
name: other
mjcf: other.xml
arm:
  joints: [a1, a2, a3, a4, a5, a6]
  actuators: [m1, m2, m3, m4, m5, m6]
  tool0_site: flange
  speed_deg_s: 90
  hardware_speed_deg_s: [60, 100, 100, 100, 100, 100]
  acceleration_deg_s2: 500
  rest_qpos_rad: [0, 0.5, 0.5, 0.2, 0, 0]
gripper:
  name: slider
  body: hand
  actuator: grip
  driver_joint: slide_right
  max_width_m: 0.1
  fingers:
    - {body: left, tip_site: left_tip, pad_geoms: [left_pad]}
    - {body: right, tip_site: right_tip, pad_geoms: [right_pad]}
self_collision:
  never_with_static: [a1]
"""

WriteRobot = Callable[..., Path]


@pytest.fixture
def write_other_robot(tmp_path: Path) -> WriteRobot:
    """Writes the second robot's files, with `old` replaced by `new` in one of them; returns the YAML's path."""

    def write(old: str = "", new: str = "", mjcf: bool = False) -> Path:
        texts = {"other.yaml": YAML, "other.xml": MJCF}
        name = "other.xml" if mjcf else "other.yaml"
        if old not in texts[name]:
            raise ValueError(f"'{old}' is not in {name}.")
        texts[name] = texts[name].replace(old, new, 1) if old else texts[name]
        for file, text in texts.items():
            (tmp_path / file).write_text(text)
        return tmp_path / "other.yaml"

    return write
