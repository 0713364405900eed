"""Fingerprints: a trial's id follows from all that decides its result, and from nothing else."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from torc.fingerprints import file_fingerprint, fingerprint
from torc.objects.library import builtin_object_names
from torc.objects.store import find_stored
from torc.problems.problem import Problem
from torc.specs.trial import PlannerSpec
from torc.vlm.config import VlmConfig
from torc.vlm.simulated.profiles import find_profile

ID_FORMAT = "torc-bench-trial/2"
_OWN_OBJECT_FILES = ("object.yaml", "geometry.npz", "texture_*.png")


def trial_id(
    problem: str,
    digest: str,
    planner: PlannerSpec,
    planner_source: str,
    seed: int,
    around: Mapping[str, Any],
    version: str,
) -> str:
    """64 hexadecimal digits that follow from all that decides a trial's result.

    Args:
        problem, digest: its name and fingerprint.
        planner, planner_source: who chooses, and the fingerprint of its file if it is a user's own.
        seed: of all draws.
        around: see `Conditions.facts`.
        version: torc's.
    """
    return fingerprint(
        {
            "format": ID_FORMAT,
            "torc": version,
            "problem": {"name": problem, "digest": digest},
            "planner": {
                "name": planner.name,
                "vlm": vlm_facts(planner.vlm),
                "settings": dict(planner.settings),
                "source": planner_source,
            },
            "seed": seed,
            "around": dict(around),
        }
    )


def problem_fingerprint(problem: Problem) -> str:
    """Of what can change a trial: the objects in their order, the target, its description. Not of notes and origin.

    Models that come with torc are settled by its version; the user's own count with their files.
    """
    builtin = set(builtin_object_names())
    own = {o.model for o in problem.objects} - builtin
    objects = [
        [o.name, o.model, [float(v) for v in o.position], [float(v) for v in o.wxyz]] for o in problem.objects
    ]
    return fingerprint(
        {
            "description": problem.description,
            "target": problem.target,
            "objects": objects,
            "models": {name: _own_object(name) for name in sorted(own)},
        }
    )


def vlm_facts(vlm: VlmConfig | None) -> dict[str, Any] | None:
    """What of a VLM can change its replies. Time-outs and retries cannot."""
    if vlm is None:
        return None
    facts = {
        "provider": vlm.provider,
        "url": vlm.url,
        "model": vlm.model,
        "temperature": None if vlm.temperature is None else float(vlm.temperature),
        "thinking": vlm.thinking,
        "max_output_tokens": vlm.max_output_tokens,
        "seeded": vlm.seeded,
        "structured": vlm.structured,
    }
    return facts | ({"simulated": asdict(find_profile(vlm.model))} if vlm.simulated else {})


def _own_object(name: str) -> list[str]:
    directory = find_stored(name)
    if directory is None:
        return []
    files = (file for pattern in _OWN_OBJECT_FILES for file in sorted(directory.glob(pattern)))
    return [file_fingerprint(file) for file in files if file.is_file()]
