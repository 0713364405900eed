"""`torc camera`: real cameras: what there is, what they see, and frames of it for `torc decide`."""

from dataclasses import asdict, dataclass
from typing import Annotated

import tyro

from torc.cli.commands import Group
from torc.cli.printing import print_json, printable
from torc_lab.cli.camera_record import RecordCommand
from torc_lab.cli.camera_show import ShowCommand


@dataclass(frozen=True)
class ListCommand:
    """List the kinds of cameras, the libraries that are missing, and the devices that were found."""

    json: Annotated[bool, tyro.conf.arg(help="Print as JSON.")] = False

    def run(self) -> int:
        """Print them."""
        from torc_lab.cameras.kinds import camera_kinds

        kinds = camera_kinds()
        if self.json:
            print_json([asdict(kind) for kind in kinds])
            return 0
        width = max(len(kind.name) for kind in kinds)
        for kind in kinds:
            print(f"{kind.name:<{width}}  {kind.what}")
            for line in _about(kind.missing, kind.devices):
                print(f"{'':<{width}}    {printable(line)}")
        print(
            "\nSee through one with `torc camera show --camera NAME`; docs/cameras.md has the settings of each."
        )
        return 0


def _about(missing: str, devices: tuple[str, ...] | None) -> list[str]:
    if missing:
        return [missing]
    if devices is None:
        return []
    return [f"found: {device}" for device in devices] or ["no device found"]


CAMERA = Group(
    "Real cameras: what there is, what they see, and frames of it for `torc decide`.",
    {
        "list": ("kinds of cameras, missing libraries, connected devices", ListCommand),
        "show": ("what a camera sees: colour, depth, masks, what it does not see", ShowCommand),
        "record": ("frames for `torc decide`, or to play again", RecordCommand),
    },
    "Try:\n"
    "  torc camera list\n"
    "  torc camera show --camera realsense --out seen.png\n"
    "  torc camera record --camera realsense --out frames\n"
    "  torc decide frames/frame_0001",
)
