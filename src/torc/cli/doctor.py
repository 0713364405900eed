"""`torc doctor`: what is missing on this machine, and how to get it."""

import importlib.util
import os
import shutil
import sys
from dataclasses import asdict, dataclass
from typing import Annotated

import tyro


@dataclass(frozen=True)
class Check:
    """One finding: ok, or a note with its remedy. `required` ones decide the exit code."""

    name: str
    ok: bool
    detail: str
    remedy: str = ""
    required: bool = True


@dataclass(frozen=True)
class DoctorCommand:
    """Say what is missing on this machine and how to get it. Exit code 0 if everything required is there."""

    json: Annotated[bool, tyro.conf.arg(help="Print the findings as JSON.")] = False

    def run(self) -> int:
        """Print the findings; returns the exit code."""
        checks = all_checks()
        if self.json:
            import json

            print(json.dumps([asdict(check) for check in checks], indent=2))
        else:
            for check in checks:
                mark = "ok  " if check.ok else ("MISS" if check.required else "note")
                print(f"{mark}  {check.name}: {check.detail}")
                if not check.ok and check.remedy:
                    print(f"      -> {check.remedy}")
        return 0 if all(check.ok or not check.required for check in checks) else 1


def all_checks() -> list[Check]:
    """All findings, required ones first."""
    return [_python(), *_libraries(), _rendering(), _cores(), _kernels(), _cache(), *_extras(), _disk()]


def _python() -> Check:
    version = ".".join(map(str, sys.version_info[:3]))
    return Check("Python", sys.version_info >= (3, 11), version, "Install Python 3.11 or newer.")


def _libraries() -> list[Check]:
    needed = {"numpy": "numpy", "numba": "numba", "mujoco": "mujoco-core", "ompl": "ompl", "pink": "pin-pink"}
    needed |= {"toppra": "toppra", "daqp": "daqp", "cv2": "opencv-python-headless", "av": "av"}
    missing = [package for module, package in needed.items() if importlib.util.find_spec(module) is None]
    detail = f"missing: {', '.join(missing)}" if missing else f"all {len(needed)} found"
    return [Check("libraries", not missing, detail, f"pip install {' '.join(missing)}")]


def _rendering() -> Check:
    from torc.sim.gl import gl_backend

    backend = gl_backend()
    remedy = "apt-get install libegl1 libopengl0 libgl1-mesa-dri   (or libosmesa6 alone)"
    if backend in ("egl", "osmesa", "glfw"):
        return Check("rendering", True, f"OpenGL through {backend}")
    detail = "no OpenGL: the camera works by casting rays (slower, plainer pictures)"
    return Check("rendering", False, detail, remedy, required=False)


def _cores() -> Check:
    return Check("cores", True, f"{os.cpu_count()}")


def _kernels() -> Check:
    from torc.pipeline.warm_up import MESSAGE, kernels_are_cached

    if kernels_are_cached():
        return Check("kernels", True, "compiled and cached")
    return Check(
        "kernels", False, "not compiled yet", f"Nothing to do; the first run says: {MESSAGE}", required=False
    )


def _cache() -> Check:
    from torc.pipeline.warm_up import cache_directory

    path = cache_directory()
    probe = next(p for p in (path, *path.parents) if p.exists())
    ok = os.access(probe, os.W_OK)
    return Check("cache", ok, str(path), f"Make '{probe}' writable or set XDG_CACHE_HOME.", required=False)


def _extras() -> list[Check]:
    extras = {"train": ("sklearn", "training the grasp model"), "dev": ("pytest", "running the tests")}
    return [
        Check(
            f"extra '{extra}'",
            importlib.util.find_spec(module) is not None,
            f"for {use}",
            f"pip install 'torc[{extra}]'",
            required=False,
        )
        for extra, (module, use) in extras.items()
    ]


def _disk() -> Check:
    free_gb = shutil.disk_usage(".").free / 1e9
    return Check("disk", free_gb > 1, f"{free_gb:.0f} GB free here", "Free some space.", required=False)
