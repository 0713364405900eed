"""`torc robots`: list the robots, and check whether a user-defined one can work."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from torc.cli.commands import Group
from torc.cli.options import JsonOption, check_picture_name
from torc.cli.printing import print_json, printable
from torc.robots.names import DEFAULT_ROBOT, robot_names

if TYPE_CHECKING:
    from torc.robots.description import RobotDescription
    from torc.workspace.description import Workspace

_LITTLE = 0.2
"""An arm that reaches less than this share of the table gets a note."""
_SAGS_RAD = 0.05
_ACROSS = 5
_ABOVE_TABLE_M = 0.05


@dataclass(frozen=True)
class ListCommand:
    """List the robots that come with torc."""

    json: JsonOption = False

    def run(self) -> int:
        from torc.robots.loading import load_robot

        robots = {name: load_robot(name) for name in robot_names()}
        rows = [
            {"name": name, "joints": robot.arm.dof, "opens_mm": round(1000 * robot.gripper.max_width_m)}
            for name, robot in robots.items()
        ]
        if self.json:
            print_json(rows)
            return 0
        for row in rows:
            default = "   the default" if row["name"] == DEFAULT_ROBOT else ""
            print(f"{row['name']:<14}{row['joints']} joints, opens {row['opens_mm']} mm{default}")
        return 0


@dataclass(frozen=True)
class CheckCommand:
    """Try a robot: does each actuator move its own joint, does the gripper close, how much of the table is in reach?

    Exit code 0 if it can work, 1 if not, 2 if its files cannot be read.

    Examples:
      torc robots check my_robot.yaml --picture my_robot.png
      torc robots check ur5e_2f85 --workspace my_table.yaml
    """

    robot: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FILE")]
    """A robot file, or the name of a robot that comes with torc."""
    workspace: str = "paper"
    """Workspace with the table: a name, or a workspace file."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="PNG")] = None
    """Also draw the robot at rest beside the table."""
    json: Annotated[bool, tyro.conf.arg(help="Print the findings as JSON.")] = False

    def run(self) -> int:
        if self.picture is not None:
            check_picture_name(self.picture, ".png")
        from torc.io.pictures import write_png
        from torc.robots.loading import robot_file
        from torc.robots.parsing import try_robot
        from torc.sim.portraits import robot_portrait
        from torc.workspace.workspace_files import load_workspace

        workspace = load_workspace(self.workspace)
        robot, faults = try_robot(robot_file(self.robot))
        findings = [*_findings(robot, faults, workspace)]
        if self.json:
            print_json({"name": robot.name, "checks": [asdict(finding) for finding in findings]})
        else:
            for finding in findings:
                print(printable(f"{finding.mark:<4}  {finding.name:<12}  {finding.detail}"))
        if self.picture is not None:
            write_png(self.picture, robot_portrait(robot, workspace))
        return 0 if all(finding.mark != "FAIL" for finding in findings) else 1


@dataclass(frozen=True)
class _Finding:
    """One line of the check: ok, note (it may be intended) or FAIL."""

    mark: Literal["ok", "note", "FAIL"]
    name: str
    detail: str


def _findings(
    robot: "RobotDescription", faults: Mapping[str, list[str]], workspace: "Workspace"
) -> Iterator[_Finding]:
    """Yield the findings: faults of loading the robot by what they concern, its base, its reach, its servos."""
    import numpy as np

    from torc.robots.ik import reached
    from torc.robots.parsing import compile_mjcf
    from torc.robots.proving import sags_rad

    gripper, length_m = robot.gripper, float(robot.gripper.T_tool0_tcp(0.0)[2, 3])
    good = {
        "surroundings": "no floor, table or free body of its own",
        "arm": f"{robot.arm.dof} joints, each moved by its own actuator",
        "gripper": f"opens to {1000 * gripper.max_width_m:.0f} mm, closes at the upper end of its ctrlrange",
        "fingertips": f"{1000 * length_m:.0f} mm ahead of the flange, pointing outward",
        "rest": "no part touches another",
    }
    for name, found in faults.items():
        yield from (_Finding("FAIL", name, fault) for fault in found)
        if not found:
            yield _Finding("ok", name, good[name])
    x, y, z = robot.arm.T_world_base[:3, 3]
    yield _Finding("ok", "base", f"at ({x:.2f}, {y:.2f}, {z:.2f}) m in the world, z = 0 on the floor")

    points = workspace.watched_table(_ACROSS) + np.array([0, 0, _ABOVE_TABLE_M])
    share = float(np.mean(reached(robot, points)))
    text = f"{share:.0%} of the table, {100 * _ABOVE_TABLE_M:.0f} cm above it"
    if share < _LITTLE:
        low, high = points.min(axis=0), points.max(axis=0)
        text += f" (x {low[0]:.2f} to {high[0]:.2f}, y {low[1]:.2f} to {high[1]:.2f}, z {low[2]:.2f} m). "
        text += "Is the base where you think it is? The MJCF places it, in torc's world"
    yield _Finding("FAIL" if share == 0 else "note" if share < _LITTLE else "ok", "reach", text)

    if not faults["arm"]:
        sags = zip(robot.arm.joint_names, sags_rad(robot, compile_mjcf(robot.mjcf_path)))
        weak = ", ".join(f"'{name}' by {sag:.2f} rad" for name, sag in sags if sag > _SAGS_RAD)
        text = f"give way under its weight: {weak}. Raise kp, or set gravcomp to 1"
        yield _Finding("note", "servos", text) if weak else _Finding("ok", "servos", "hold the arm at rest")


ROBOTS = Group(
    "The robots that come with torc, and your own.",
    {
        "list": ("the robots that come with torc", ListCommand),
        "check": ("whether a robot of your own can work", CheckCommand),
    },
)
