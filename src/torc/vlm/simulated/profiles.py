"""How good a simulated VLM is: profiles by name, or an accuracy.

`paper` is calibrated to the paper's VLM (Gemini Robotics-ER 1.5) by `benchmarks/vlm_calibration.py`; docs/vlm.md gives
the source of each of its numbers.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from torc.errors import InputError, UnknownNameError


@dataclass(frozen=True)
class Profile:
    """Probabilities of being right, 0..1. Each fact is yes or no, so 0.5 is knowing nothing.

    Attributes:
        sees_target: on whether the target is in sight.
        front: on whether one of two objects that meet in the image stands in front of the other; and, for a hidden
            target, on whether an object hides it.
        below: on whether one of two objects lies on the other, and which.
        free: on an object that the robot can grasp, and on a neighbour that is not in the way.
        blocked: on an object that it cannot grasp, and on a neighbour that is in the way.
        heeds_facts: probability that it goes by what the prompt says about an object's grasps.
        made_up: probability that it names an object that is not there.
        malformed: probability that its reply cannot be read: cut short, refused, empty, in a wrong form.
    """

    name: str
    sees_target: float
    front: float
    below: float
    free: float
    blocked: float
    heeds_facts: float
    made_up: float = 0.02
    malformed: float = 0.02


def profile_of_accuracy(accuracy: float, name: str) -> Profile:
    """Return a profile that is right on every fact with this probability; a fifth of the rest is made up, a fifth
    malformed.
    """
    slips = (1.0 - accuracy) / 5.0
    a = accuracy
    return Profile(name, a, a, a, a, a, a, made_up=slips, malformed=slips)


PROFILES: Mapping[str, Profile] = MappingProxyType(
    {
        "hopeless": profile_of_accuracy(0.5, "hopeless"),
        "poor": profile_of_accuracy(0.7, "poor"),
        "paper": Profile(
            "paper", sees_target=1.0, front=0.86, below=0.89, free=1.0, blocked=0.09, heeds_facts=0.39
        ),
        "good": profile_of_accuracy(0.9, "good"),
        "perfect": profile_of_accuracy(1.0, "perfect"),
    }
)
"""From knowing nothing to knowing everything; an accuracy, e.g. "0.8", makes further ones."""


def find_profile(text: str) -> Profile:
    """Return the profile of that name, or of an accuracy from 0 to 1. Raises InputError."""
    if text in PROFILES:
        return PROFILES[text]
    try:
        accuracy = float(text)
    except ValueError:
        raise UnknownNameError("profile of the simulated VLM", text, [*PROFILES, "0.5", "0.8"]) from None
    if not (math.isfinite(accuracy) and 0.0 <= accuracy <= 1.0):
        raise InputError(
            f"'{text}' is no accuracy of the simulated VLM: write simulated:0.8 (0 to 1), or one of "
            f"{', '.join(f'simulated:{name}' for name in PROFILES)}."
        )
    return profile_of_accuracy(accuracy, f"{accuracy:g}")
