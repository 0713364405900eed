"""Which models of the library the gripper gets hold of, as measured in the simulator.

Not all: a plate that lies flat, a book wider than the opening. The facts are of the gripper alone, with nothing else
on the table; whether the arm reaches is asked of each scene. Made by `python -m tools.grasp_model graspable`.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

FACTS_PATH = Path(__file__).parent / "data" / "graspable.json"


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
    """What is known of the library's models, by name."""
    return read_facts(FACTS_PATH)


def read_facts(path: Path) -> Mapping[str, GraspFact]:
    """Facts from a file."""
    content = json.loads(path.read_text(encoding="utf-8"))
    return {name: GraspFact(**fact) for name, fact in content["models"].items()}


def graspable(name: str) -> bool | None:
    """Whether a model can be grasped as it stands, with nothing around it; None if that was never measured."""
    fact = all_grasp_facts().get(name)
    return None if fact is None else fact.standing > 0.0
