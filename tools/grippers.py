"""The shipped arm with other grippers: two fingers on slides, as on a Panda hand, of any opening.

python -m tools.grippers DIR 0.078 0.14     # writes DIR/slides_078.yaml and DIR/slides_140.yaml
"""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import yaml

from torc.robots.schema import EXAMPLE

_FINGERS = ("left", "right")
_TIES = ("contact", "tendon", "equality", "actuator")
_TIP_M = 0.045
"""Length of a finger."""


def write_slides(directory: Path, max_width_m: float) -> Path:
    """Write a robot whose gripper opens to max_width_m, as YAML and MJCF. Returns the YAML file."""
    directory.mkdir(parents=True, exist_ok=True)
    name = f"slides_{1000 * max_width_m:03.0f}"
    facts = yaml.safe_load(EXAMPLE.read_text(encoding="utf-8"))
    mjcf = _whole(EXAMPLE.with_name(facts["mjcf"]))
    _exchange(mjcf, max_width_m)
    ElementTree.ElementTree(mjcf).write(directory / f"{name}.xml", encoding="unicode")
    fingers = [
        {"body": f"gripper_{side}_finger", "tip_site": f"{side}_tip", "pad_geoms": [f"{side}_pad"]}
        for side in _FINGERS
    ]
    gripper = {
        "name": name,
        "body": "gripper_base",
        "actuator": "gripper_motor",
        "driver_joint": "right_slide",
        "max_width_m": max_width_m,
        "fingers": fingers,
    }
    facts |= {"name": f"sda10f_{name}", "mjcf": f"{name}.xml", "gripper": gripper}
    path = directory / f"{name}.yaml"
    path.write_text(yaml.safe_dump(facts, sort_keys=False), encoding="utf-8")
    return path


def _whole(path: Path) -> ElementTree.Element:
    """An MJCF with what it includes in place."""
    root = ElementTree.parse(path).getroot()
    for holder in list(root.iter()):
        for place, part in reversed(list(enumerate(holder))):
            if part.tag == "include":
                holder[place : place + 1] = list(_whole(path.parent / part.attrib["file"]))
    return root


def _exchange(mjcf: ElementTree.Element, max_width_m: float) -> None:
    """Put slides in the place of the shipped gripper."""
    base = next(b for b in mjcf.iter("body") if b.get("name") == "gripper_base")
    for part in list(base):
        if part.tag in ("geom", "body"):
            base.remove(part)
    base.extend(ElementTree.fromstring(_hand(0.5 * max_width_m)))
    for holder in mjcf:
        for part in list(holder):
            if holder.tag in _TIES and any("gripper" in value for value in part.attrib.values()):
                holder.remove(part)
    mjcf.extend(ElementTree.fromstring(_ties(0.5 * max_width_m)))


def _hand(half_m: float) -> str:
    """A palm, and a finger on either side of it."""
    palm = f'type="box" size="{half_m + 0.02:.4f} 0.025 0.022" pos="0 0 0.046"'
    return f"""<hand>
      <geom class="robot_visual" size="0.0375 0.012" pos="0 0 0.012" material="robot_dark"/>
      <geom class="robot_visual" {palm} material="robot_white"/>
      <geom class="robot_collision" type="cylinder" size="0.0375 0.012" pos="0 0 0.012" mass="0.3"/>
      <geom class="robot_collision" {palm} mass="0.3"/>
      {_finger("left", -1, half_m)}{_finger("right", 1, half_m)}
    </hand>"""


def _finger(side: str, sign: int, half_m: float) -> str:
    pad = f'type="box" size="0.004 0.010 {_TIP_M / 2}" pos="{0.004 * sign} 0 {_TIP_M / 2}"'
    return f"""<body name="gripper_{side}_finger" pos="{sign * half_m:.4f} 0 0.068" gravcomp="1">
      <joint name="{side}_slide" type="slide" axis="{-sign} 0 0" range="0 {half_m:.4f}" armature="0.3" damping="1"/>
      <geom class="robot_visual" {pad} material="robot_steel"/>
      <geom name="{side}_pad" class="gripper_pad" {pad} mass="0.03"/>
      <site name="{side}_tip" pos="0 0 {_TIP_M}"/>
    </body>"""


def _ties(half_m: float) -> str:
    return f"""<ties>
      <contact>
        <exclude body1="gripper_base" body2="gripper_left_finger"/>
        <exclude body1="gripper_base" body2="gripper_right_finger"/>
        <exclude body1="gripper_left_finger" body2="gripper_right_finger"/>
      </contact>
      <equality><joint joint1="left_slide" joint2="right_slide" polycoef="0 1 0 0 0"/></equality>
      <actuator>
        <position name="gripper_motor" joint="right_slide" kp="2000" kv="100" ctrlrange="0 {half_m + 0.02:.4f}"
                  forcerange="-120 120"/>
      </actuator>
    </ties>"""


if __name__ == "__main__":
    for text in sys.argv[2:]:
        print(write_slides(Path(sys.argv[1]), float(text)))
