"""`torc settings`: what can be set in each stage."""

from dataclasses import dataclass, fields, is_dataclass
from typing import Annotated, Any

import tyro

from torc.errors import UnknownNameError


@dataclass(frozen=True)
class SettingsCommand:
    """List the settings of the stages, with their defaults. Each is an option of `torc run`, `torc bench` and others:

      torc run structured-01 --occlusion.smooth-px 3
      torc bench --sweep occlusion.smooth_px=0,3 --out runs/smoothing

    A part of your own takes its settings as arguments, or as fields of a dataclass that it takes as `config`.
    """

    stages: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="[STAGE...]")] = ()
    """Stages to list; all if none is given."""

    def run(self) -> int:
        """Print them."""
        from torc.pipeline.building import stage_configs

        configs = stage_configs()
        for stage in self.stages or tuple(configs):
            if stage not in configs:
                raise UnknownNameError("stage", stage, list(configs))
            for path, value in _settings(configs[stage], stage):
                print(f"--{path.replace('_', '-'):<44} {value}")
        return 0


def _settings(config: Any, path: str) -> list[tuple[str, Any]]:
    """Every setting with its default, the nested ones by their dotted path."""
    found: list[tuple[str, Any]] = []
    for field in fields(config):
        value, here = getattr(config, field.name), f"{path}.{field.name}"
        found += _settings(value, here) if is_dataclass(value) else [(here, value)]
    return found
