"""The file of grasp facts is written here, and a digest tells which models have changed since they were measured."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np

from torc.objects.library import FACTS_PATH, GraspFact
from torc.objects.models import ObjectModel

FORMAT = "torc-graspable/1"
_OFF_GRID = 0.3137
"""Of a step: sizes that people choose lie far from where one step ends and the next begins."""


def save_facts(facts: Mapping[str, GraspFact], path: Path = FACTS_PATH) -> None:
    """Writes facts, one line each."""
    lines = [f"  {json.dumps(name)}: {json.dumps(asdict(fact))}" for name, fact in facts.items()]
    body = ",\n".join(lines)
    path.write_text(f'{{"format": "{FORMAT}", "models": {{\n{body}\n}}}}\n', encoding="utf-8")


def model_digest(model: ObjectModel) -> str:
    """A short digest of what decides how a model is held: contact pieces, mass, friction; the same on every machine.

    Numbers count in steps of a millionth: the last bits of a product of matrices depend on the processor.
    """
    digest = hashlib.sha256()

    def add(*numbers: object) -> None:
        flat = np.concatenate([np.ravel(np.asarray(n, dtype=np.float64)) for n in numbers])
        steps = np.floor(flat * 1e6 + _OFF_GRID).astype(np.int64)
        digest.update(repr(steps.tolist()).encode())

    for piece in model.pieces:
        digest.update(piece.kind.encode())
        add(piece.size, piece.position, piece.wxyz, piece.relative_density)
        add(() if piece.vertices is None else piece.vertices)
    add(model.mass_kg, model.friction, model.rolls)
    return digest.hexdigest()[:16]
