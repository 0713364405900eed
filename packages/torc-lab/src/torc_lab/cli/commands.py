"""Commands that the entry points of the group `torc.commands` refer to."""

RETRIEVE = ("one retrieval with a real robot, or its twin", "torc_lab.cli.retrieve:RetrieveCommand")
LAB = ("real arm, gripper and camera; twins to rehearse with", "torc_lab.cli.lab:LAB")
CAMERA = ("real cameras: list, show, record what they see", "torc_lab.cli.camera:CAMERA")
