"""The stage `--depth onnx`: depth from two pictures by a matcher in an ONNX file, with S2M2's inputs and outputs.

Inputs `input_left` and `input_right`: RGB, 0 to 255, uint8 or float, (1, 3, H, W) with H and W multiples of 32. Outputs
`output_disp` (pixels of the left picture) and `output_conf` (0 to 1); `output_occ` is not used.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float32, UInt8

from torc.errors import InputError, MissingDependencyError
from torc.perception.embedded.model import onnx_session
from torc.perception.stereo import LearnedStereoConfig, pair_of, scaled, with_disparity
from torc.records import Observation
from torc.registry.kinds import DepthTraits

_MULTIPLE_PX = 32
_KINDS = {"tensor(uint8)": np.uint8, "tensor(float)": np.float32, "tensor(float16)": np.float16}
_INPUTS, _OUTPUTS = ("input_left", "input_right"), ("output_disp", "output_conf")


@dataclass(frozen=True)
class OnnxStereoConfig(LearnedStereoConfig):
    """A matcher in a file.

    Attributes:
        model: path of the .onnx file.
        threads: of the processor, if there is no GPU.
    """

    model: str = ""
    threads: int = 1
    min_confidence: float = 0.1


class OnnxDepth(DepthTraits):
    """Depth from the camera's two pictures, matched by onnxruntime in this process."""

    needs_pair = True
    rough = True

    def __init__(self, config: OnnxStereoConfig | None = None) -> None:
        self.config = OnnxStereoConfig() if config is None else config
        if not self.config.model:
            raise InputError("--depth onnx needs a matcher: --depth.model FILE.onnx (docs/networks.md).")

    def measure(self, observation: Observation) -> Observation:
        """Return the observation with depth from its pair.

        Raises InputError if it has none, or if the file is not a valid matcher; MissingDependencyError without
        onnxruntime.
        """
        config, pair = self.config, pair_of(observation, "onnx")
        left, right = scaled(pair.left, config.scale), scaled(pair.right, config.scale)
        disparity, confidence = _opened(config.model, config.threads).match(left, right)
        return with_disparity(observation, disparity, confidence, pair.baseline_m, config)


class OnnxMatcher(NamedTuple):
    """An open model; `size` is its fixed height and width, None if it takes any multiple of 32."""

    session: Any
    kind: Any
    size: tuple[int, int] | None

    def match(
        self, left: UInt8[np.ndarray, "h w"], right: UInt8[np.ndarray, "h w"]
    ) -> tuple[Float32[np.ndarray, "a b"], Float32[np.ndarray, "a b"]]:
        """Return disparity and confidence, in the pixels of the pictures that the model got.

        Pictures that are too large for a model of a fixed size are scaled down, and padded to its size at the right and
        at the bottom.
        """
        height, width = (-(-n // _MULTIPLE_PX) * _MULTIPLE_PX for n in left.shape)
        most = self.size or (height, width)
        share = min(1.0, most[0] / left.shape[0], most[1] / left.shape[1])
        small = [scaled(p, share)[: most[0], : most[1]] for p in (left, right)]
        found = self.session.run(list(_OUTPUTS), dict(zip(_INPUTS, (self._input(p, most) for p in small))))
        if any(o.shape[-2:] != most or o.size != most[0] * most[1] for o in found):
            raise InputError(
                f"This matcher's outputs are {[o.shape for o in found]}; they must be {most} pixels."
            )
        rows, cols = small[0].shape
        disparity, confidence = (np.asarray(o, np.float32).reshape(most)[:rows, :cols] for o in found)
        return disparity, confidence

    def _input(self, picture: UInt8[np.ndarray, "h w"], size: tuple[int, int]) -> np.ndarray:
        """Return the input, (1, 3, H, W)."""
        below, beside = size[0] - picture.shape[0], size[1] - picture.shape[1]
        filled = np.pad(picture, ((0, below), (0, beside)), mode="edge")
        return np.repeat(filled[None, None], 3, axis=1).astype(self.kind)


@lru_cache(maxsize=2)
def _opened(path: str, threads: int) -> OnnxMatcher:
    """Open a matcher. Raises InputError if the file cannot be read or has other inputs and outputs."""
    try:
        session = onnx_session(Path(path), threads, "--depth onnx", gpu=True)
    except MissingDependencyError:
        raise
    except Exception as error:  # onnxruntime's own errors share no class
        raise InputError(f"--depth.model '{path}' is no model that onnxruntime reads: {error}.") from error
    inputs = {i.name: i for i in session.get_inputs()}
    outputs = {o.name for o in session.get_outputs()}
    kinds = {_KINDS.get(i.type) for i in inputs.values()}
    kind = kinds.pop() if len(kinds) == 1 else None
    if set(inputs) != set(_INPUTS) or not set(_OUTPUTS) <= outputs or kind is None:
        found = f"inputs {sorted(inputs)}, outputs {sorted(outputs)}"
        raise InputError(
            f"--depth.model '{path}' has {found}. It needs the inputs {list(_INPUTS)}, pictures of uint8 or float, and "
            f"the outputs {list(_OUTPUTS)}, as S2M2's export has them (docs/networks.md)."
        )
    height, width = inputs[_INPUTS[0]].shape[-2:]
    fixed = isinstance(height, int) and isinstance(width, int)
    return OnnxMatcher(session, kind, (height, width) if fixed else None)
