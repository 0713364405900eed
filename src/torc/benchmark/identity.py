"""Fingerprints: a trial's id follows from all that decides its result, and from nothing else."""

import hashlib
import inspect
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from torc.robots.loading import load_robot, robot_names
from torc.scenes.library import builtin_object_names
from torc.scenes.object_store import find_stored
from torc.scenes.problem import Problem
from torc.vlm.config import VlmConfig
from torc.vlm.simulated.profiles import find_profile

ID_FORMAT = "torc-bench-trial/1"
_OWN_OBJECT_FILES = ("object.yaml", "geometry.npz")


def fingerprint(facts: Mapping[str, Any]) -> str:
    """SHA-256 of plain data; the order of keys does not count."""
    text = json.dumps(facts, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


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


def file_fingerprint(path: Path) -> str:
    """SHA-256 of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def robot_source(name_or_path: str) -> str:
    """Fingerprint of a robot's files with all that its MJCF pulls in; "" for robots that come with torc.

    Raises InputError for one that cannot be used.
    """
    robot = load_robot(name_or_path)
    if name_or_path in robot_names():
        return ""
    model = mujoco.MjSpec.from_file(str(robot.mjcf_path)).compile()
    compiled = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, compiled)
    return fingerprint(
        {
            "description": file_fingerprint(Path(name_or_path)),
            "model": hashlib.sha256(compiled.tobytes()).hexdigest(),
        }
    )


def part_source(maker: Any) -> str:
    """Fingerprint of the file that defines a planner; "" where there is none, e.g. compiled ones."""
    try:
        path = inspect.getsourcefile(maker)
        return file_fingerprint(Path(path)) if path else ""
    except (TypeError, OSError):
        return ""


def _own_object(name: str) -> list[str]:
    directory = find_stored(name)
    if directory is None:
        return []
    return [file_fingerprint(directory / file) for file in _OWN_OBJECT_FILES if (directory / file).is_file()]
