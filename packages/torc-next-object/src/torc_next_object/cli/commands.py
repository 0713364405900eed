"""What the entry points of the group `torc.commands` name."""

from torc.cli.commands import Entry
from torc_next_object.cli import next_object
from torc_next_object.cli.vlm_eval import VlmEvalCommand

VLM_EVAL: Entry = ("how well a VLM chooses objects, on recorded decisions", VlmEvalCommand)
NEXT_OBJECT: Entry = ("which object first: a data set, scored without a simulator", next_object.NEXT_OBJECT)
