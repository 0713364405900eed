"""What inspect_ai finds under the name torc_next_object: `inspect eval torc_next_object/next_object_image`."""

from torc_next_object.harnesses.inspect_retrieval import retrieval, retrieve, retrieved
from torc_next_object.harnesses.inspect_tasks import (
    next_object,
    next_object_grasps,
    next_object_image,
    next_object_relations,
    next_object_scores,
)

__all__ = [
    "next_object",
    "next_object_grasps",
    "next_object_image",
    "next_object_relations",
    "next_object_scores",
    "retrieval",
    "retrieve",
    "retrieved",
]
