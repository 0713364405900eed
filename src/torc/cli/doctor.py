"""`torc doctor`: find what this machine lacks, and how to get it."""

import importlib
import os
import platform
import shutil
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import tyro

import torc
from torc.cli.printing import print_json
from torc.errors import extra_remedy

_LIBRARIES = {"cv2": "opencv-python-headless", "mujoco": "mujoco-core"}
"""Package of a module, where the names differ."""
_EXTRAS = {
    "import": ("coacd", "importing meshes"),
    "web": ("starlette", "the page of torc human and torc view"),
    "gym": ("gymnasium", "the Gymnasium environment torc/Retrieval-v0"),
    "export": ("pyarrow", "torc export --format lerobot"),
    "ray": ("ray", "torc bench --ray, on many machines"),
    "report": ("matplotlib", "the figures of torc report, and its tables as Parquet"),
    "lab": ("torc_lab", "real robots: torc lab, torc retrieve, torc camera"),
    "realsense": ("pyrealsense2", "RealSense cameras"),
    "next-object": ("torc_next_object", "torc vlm-eval, and the data set torc-next-object"),
    "networks": ("torc_networks", "networks in processes of their own, and torc serve"),
    "sam": ("transformers", "the perceptions grounded-sam2 and sam3"),
    "dev": ("pytest", "running the tests, training the grasp model"),
}
"""By extra, one of its modules, and its purpose."""


@dataclass(frozen=True)
class Check:
    """One finding: ok, or a note with its remedy. `required` ones decide the exit code."""

    name: str
    ok: bool
    detail: str
    remedy: str = ""
    required: bool = False


@dataclass(frozen=True)
class DoctorCommand:
    """Say what is missing on this machine and how to get it. Exit code 0 if everything required is there."""

    json: Annotated[bool, tyro.conf.arg(help="Print the findings as JSON.")] = False

    def run(self) -> int:
        checks = []
        for check in _checks():
            checks.append(check)
            if not self.json:
                mark = "ok  " if check.ok else ("MISS" if check.required else "note")
                print(f"{mark}  {check.name}: {check.detail}", flush=True)
                if not check.ok:
                    print(f"      -> {check.remedy}", flush=True)
        if self.json:
            print_json([asdict(check) for check in checks])
        return 0 if all(check.ok or not check.required for check in checks) else 1


def _checks() -> Iterator[Check]:
    """Yield all findings, each as it is found, since some take seconds."""
    yield Check("torc", True, f"{torc.__version__}, in {Path(torc.__file__).parent}")
    good, remedy = (3, 11) <= sys.version_info < (3, 14), "Install Python 3.11, 3.12 or 3.13."
    yield Check("Python", good, platform.python_version(), remedy, required=True)
    for module in ("numpy", "numba", "mujoco", "cv2", "av", "onnxruntime"):
        try:
            importlib.import_module(module)  # an installed one may still lack a system library
        except (ImportError, OSError) as error:
            package = _LIBRARIES.get(module, module)
            yield Check("library", False, f"{module}: {error}", f"pip install {package}", required=True)
        except Exception as error:  # MuJoCo refuses an unknown MUJOCO_GL
            remedy = f"Unset {_set_for_gl() or 'what stands in its way'}."
            yield Check("library", False, f"{module}: {error}", remedy, required=True)
            return
    from torc.pipeline.warm_up import MESSAGE, kernel_cache

    yield _rendering()
    yield Check("cores", True, f"{os.cpu_count()}")
    path, compiled = kernel_cache()
    detail = "compiled and cached" if compiled else "not compiled yet"
    yield Check("kernels", compiled, detail, f"Nothing to do; the first run says: {MESSAGE}")
    probe = next(p for p in (path, *path.parents) if p.exists())
    remedy = f"Make '{probe}' writable or set NUMBA_CACHE_DIR."
    yield Check("cache", os.access(probe, os.W_OK), str(path), remedy)
    for extra, (module, use) in _EXTRAS.items():
        yield Check(f"extra '{extra}'", find_spec(module) is not None, f"for {use}", extra_remedy(extra))
    yield from _two_mujocos()
    yield from _foreign_pyzed()
    free_gb = shutil.disk_usage(".").free / 1e9
    yield Check("disk", free_gb > 1, f"{free_gb:.0f} GB free here", "Free some space.")


def _rendering() -> Check:
    """Check that a picture can be drawn as `torc run` draws it: a library that loads may still fail to draw."""
    from torc.sim.gl import try_drawing

    backend, fault = try_drawing()
    missing = "apt-get install libegl1 libopengl0 libgl1-mesa-dri   (or libosmesa6 alone)"
    remedy = f"Unset {given}; or: {missing}" if (given := _set_for_gl()) else missing
    if fault:
        return Check("rendering", False, f"no picture can be drawn: {fault}", remedy, required=True)
    if backend == "rays":
        return Check("rendering", False, "no OpenGL: slower, plainer pictures, by casting rays", remedy)
    return Check("rendering", True, f"OpenGL through {backend}; a picture was drawn")


def _set_for_gl() -> str:
    """Return what the environment sets for OpenGL, for messages."""
    names = ("MUJOCO_GL", "PYOPENGL_PLATFORM")
    return " and ".join(f"{name}={os.environ[name]}" for name in names if name in os.environ)


def _two_mujocos() -> Iterator[Check]:
    """Yield a note if both packages that own the folder mujoco/ are installed."""
    if all(any(metadata.distributions(name=package)) for package in ("mujoco", "mujoco-core")):
        detail = "mujoco and mujoco-core are both installed, and each overwrites files of the other"
        remedy = "pip uninstall mujoco mujoco-core; pip install mujoco-core"
        yield Check("mujoco", False, detail, remedy)


def _foreign_pyzed() -> Iterator[Check]:
    """Yield a note if there is a package pyzed without the ZED SDK's module in it."""
    try:
        foreign = find_spec("pyzed") is not None and find_spec("pyzed.sl") is None
    except ModuleNotFoundError:  # pyzed is not a package, but one file
        foreign = True
    if foreign:
        detail = "the installed package pyzed is not the ZED SDK's: another project has that name on PyPI"
        remedy = "pip uninstall pyzed; docs/cameras.md says how to get the right one"
        yield Check("pyzed", False, detail, remedy)
