"""torc's own eyes, with outlines redrawn by SAM 2."""

from torc.perception.sam.refining import Sam2OnnxPerception as PART
