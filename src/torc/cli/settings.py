"""`torc settings`: the settings of each part."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import tyro

from torc.errors import UnknownNameError
from torc.registry.kinds import CONFIGURED, KINDS, STAGES, Kind
from torc.registry.loading import load_part, load_path, part_paths
from torc.registry.settings import settings_of


@dataclass(frozen=True)
class SettingsCommand:
    """List the settings of stages and parts, with their defaults. Each is an option of `torc run`, `torc bench` and
    others; those of drivers are entries of a lab file:

      torc settings occlusion
      torc settings dg-select my_module:MyPlanner path/to/file.py:MyCamera
      torc run structured-01 --occlusion.smooth-px 3
      torc bench --sweep occlusion.smooth_px=0,3 --out runs/smoothing

    A part of your own takes its settings as arguments, or as fields of a dataclass that it takes as `config`.
    """

    parts: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="[STAGE|PART...]")] = ()
    """Stages, names of parts, or your own as module:Class or path/to/file.py:Class; all stages if none is given."""

    def run(self) -> int:
        for name in self.parts or (*STAGES, *CONFIGURED):
            for line in _lines(name):
                print(line)
        return 0


def _lines(name: str) -> Iterator[str]:
    """Yield the settings of a stage, of every part of that name, or of a user-defined class."""
    from torc.pipeline.building import default_config

    if name in STAGES or name in CONFIGURED:
        config = default_config(name)
        yield from [] if config is None else _shown(name, settings_of(config), in_file=False)
        return
    if ":" in name:
        found = load_path(f"'{name}'", name)
        fitting = [kind for kind in KINDS if callable(getattr(found, kind.method, None))]
        parts: list[tuple[Kind[Any] | None, Any]] = [(kind, found) for kind in fitting] or [(None, found)]
    else:
        parts = [(kind, load_part(kind, name)) for kind in KINDS if name in part_paths(kind)]
        if not parts:
            known = {*STAGES, *CONFIGURED, *(part for kind in KINDS for part in part_paths(kind))}
            raise UnknownNameError("stage or part", name, sorted(known), ", or your own as module:Class")
    for kind, factory in parts:
        settings = settings_of(factory)
        if len(parts) > 1 or not settings:
            what = "It" if kind is None else f"{kind.title} {name}"
            yield f"{what} has no settings." if not settings else f"{what}:"
        yield from _shown("" if kind is None else kind.option, settings, kind is None or kind.in_file)


def _shown(stage: str, settings: list[tuple[str, Any]], in_file: bool) -> Iterator[str]:
    for path, value in settings:
        name = f"{stage}.{path}".lstrip(".")
        yield f"{name:<46} {value}" if in_file else f"--{name.replace('_', '-'):<44} {value}"
