"""What the entry points of the group `torc.commands` name."""

from torc.cli.commands import Entry
from torc_lab.cli import camera, lab
from torc_lab.cli.retrieve import RetrieveCommand

RETRIEVE: Entry = ("one retrieval with a real robot, or its twin", RetrieveCommand)
LAB: Entry = ("real arm, gripper and camera; twins to rehearse with", lab.LAB)
CAMERA: Entry = ("real cameras: list, show, record what they see", camera.CAMERA)
