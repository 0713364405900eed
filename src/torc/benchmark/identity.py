"""What of problems and VLMs decides the results of trials."""

from dataclasses import asdict
from typing import Any

from torc.fingerprints import file_fingerprint, fingerprint
from torc.objects.library import builtin_object_names
from torc.objects.store import find_stored
from torc.problems.problem import Problem
from torc.vlm.config import VlmConfig
from torc.vlm.simulated.profiles import find_profile

_OWN_OBJECT_FILES = ("object.yaml", "geometry.npz", "texture_*.png")


def problem_fingerprint(problem: Problem) -> str:
    """Of what can change a trial: the objects in their order, the target, its description. Not of notes and origin.

    Models that come with torc are settled by its version; the user's own count with their files.
    """
    builtin = set(builtin_object_names())
    own = {o.model for o in problem.objects} - builtin
    objects = [
        [o.name, o.model, *([float(v) for v in vector] for vector in (o.position, o.wxyz))]
        for o in problem.objects
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
    names = ("provider", "url", "model", "thinking", "max_output_tokens", "seeded", "structured")
    facts = {name: getattr(vlm, name) for name in names}
    facts["temperature"] = None if vlm.temperature is None else float(vlm.temperature)
    return facts | ({"simulated": asdict(find_profile(vlm.model))} if vlm.simulated else {})


def _own_object(name: str) -> list[str]:
    directory = find_stored(name)
    if directory is None:
        return []
    files = (file for pattern in _OWN_OBJECT_FILES for file in sorted(directory.glob(pattern)))
    return [file_fingerprint(file) for file in files if file.is_file()]
