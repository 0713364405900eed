"""`torc serve`: torc's own parts as a server of networks."""

from dataclasses import dataclass

from torc.cli.printing import split_names


@dataclass(frozen=True)
class ServeCommand:
    """Serve torc's own parts as networks are served, to try out the stages that ask a server, or as an example of one.

    The stages `--depth network`, `--perception network`, `--grasps graspgenx`, `--grasps contact-graspnet` and
    `--motion curobo` can ask it (docs/networks.md). It listens on this machine only. Ctrl-C ends it.
    """

    actions: str = "segment,stereo,infer,grasps,plan"
    """What to serve: segment (masks), stereo (disparities), infer (grasps as GraspGen gives them), grasps (as
    Contact-GraspNet does), plan (free motions)."""
    port: int = 5550
    """0 for any free one."""
    host: str = "127.0.0.1"
    """Where to listen."""
    remote: bool = False
    """Allow a host that other machines reach. Nothing is encrypted, and everybody there can use the server."""
    robot: str = "sda10f_2f85"
    """Robot whose gripper and arm are planned for: sda10f_2f85, ur5e_2f85, panda_hand, or a robot description file."""
    workspace: str = "paper"
    """Table and camera, or a workspace file."""

    def run(self) -> int:
        """Serve until Ctrl-C."""
        from torc import load_robot, load_workspace
        from torc_networks.server import serve
        from torc_networks.serving.parts import own_handlers

        robot, workspace = load_robot(self.robot), load_workspace(self.workspace)
        handlers = own_handlers(robot, workspace, split_names(self.actions))
        serve(handlers, f"torc with {robot.name}", self.port, self.host, self.remote)
        return 0


SERVE = ("torc's own parts as a server, in place of neural networks", ServeCommand)
"""What an entry point of the group `torc.commands` names."""
