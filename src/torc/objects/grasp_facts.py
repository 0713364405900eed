"""Which models of the library the gripper gets hold of, as measured in the simulator.

Not all: a plate that lies flat, a book wider than the opening. The facts are of the gripper alone, with nothing else
on the table; whether the arm reaches is asked of each scene. Made by `python -m tools.grasp_model graspable`.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from torc.errors import InputError

if TYPE_CHECKING:  # the facts alone need no numpy
    from torc.objects.models import ObjectModel

FACTS_PATH = Path(__file__).parent / "data" / "graspable.json"
FORMAT = "torc-graspable/1"
_OFF_GRID = 0.3137
"""Of a step: sizes that people choose lie far from where one step ends and the next begins."""


@dataclass(frozen=True)
class GraspFact:
    """What came of trying to grasp a model that was alone on the table, in the simulator.

    Attributes:
        standing: of the turns in which it stood in its natural pose, the share in which some grasp held.
        tumbled: the same for poses in which it came to rest after it was let go in a random orientation.
        digest: of the model's contact pieces and mass when that was measured.
    """

    standing: float
    tumbled: float
    digest: str


@cache
def all_grasp_facts() -> Mapping[str, GraspFact]:
    """What is known of the library's models, by name. Raises InputError if the file is missing or damaged."""
    return read_facts(FACTS_PATH)


def read_facts(path: Path) -> Mapping[str, GraspFact]:
    """Facts from a file. Raises InputError if it is missing or damaged."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content["format"] != FORMAT:
            raise ValueError(f"its format is not {FORMAT}")
        return {name: GraspFact(**fact) for name, fact in content["models"].items()}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path} is not readable ({error}). Install torc again, or make it with: "
            "python -m tools.grasp_model graspable"
        ) from error


def graspable(name: str) -> bool | None:
    """Whether a model can be grasped as it stands, with nothing around it; None if that was never measured."""
    fact = all_grasp_facts().get(name)
    return None if fact is None else fact.standing > 0.0


def save_facts(facts: Mapping[str, GraspFact], path: Path = FACTS_PATH) -> None:
    """Writes facts, one line each."""
    lines = [f"  {json.dumps(name)}: {json.dumps(asdict(fact))}" for name, fact in facts.items()]
    body = ",\n".join(lines)
    path.write_text(f'{{"format": "{FORMAT}", "models": {{\n{body}\n}}}}\n', encoding="utf-8")


def model_digest(model: "ObjectModel") -> str:
    """A short digest of what decides how a model is held: contact pieces, mass, friction; the same on every machine.

    Numbers count in steps of a millionth: the last bits of a product of matrices depend on the processor.
    """
    import hashlib

    import numpy as np

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
