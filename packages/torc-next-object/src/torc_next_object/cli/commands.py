"""What the entry points of the group `torc.commands` name."""

VLM_EVAL = (
    "how well a VLM chooses objects, on recorded decisions",
    "torc_next_object.cli.vlm_eval:VlmEvalCommand",
)
NEXT_OBJECT = (
    "which object first: a data set, scored without a simulator",
    "torc_next_object.cli.next_object:NEXT_OBJECT",
)
