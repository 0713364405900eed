"""Load a network through transformers, from a folder or the Hugging Face hub, and run it by its settings.

torch, torchvision and transformers are imported when a network is first used.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from torc import InputError
from torc.errors import MissingDependencyError, extra_remedy

_MOST_MISSING = 0.1
"""If a larger share of a network's arrays is missing in the weights, they are another network's."""
_ONE_INDEX = (
    "pip install --force-reinstall torch torchvision --index-url https://download.pytorch.org/whl/cpu "
    "(both from one index; docs/networks.md)"
)


class Runtime(NamedTuple):
    """Where a network runs: device, bfloat16 where that is safe (autocast), threads of the processor."""

    device: str = "cpu"
    half: bool = False
    threads: int = 1


class Kind(NamedTuple):
    """A kind of network: its name in messages, and its classes in transformers."""

    title: str
    processor: str
    model: str


# The hub's SAM 2.1 and SAM 3 call themselves video models: the Auto classes would make those of them.
GROUNDING_DINO = Kind("Grounding DINO", "AutoProcessor", "AutoModelForZeroShotObjectDetection")
SAM2 = Kind("SAM 2.1", "Sam2Processor", "Sam2Model")
SAM3 = Kind("SAM 3", "Sam3Processor", "Sam3Model")


@dataclass(frozen=True)
class Network:
    """A model of transformers with its processor, which prepares inputs and reads outputs."""

    processor: Any
    model: Any
    torch: Any
    runtime: Runtime

    @contextmanager
    def running(self) -> Iterator[None]:
        """Run without gradients, on the configured threads and precision; torch's threads are restored after."""
        torch, before = self.torch, self.torch.get_num_threads()
        torch.set_num_threads(self.runtime.threads)
        try:
            with (
                torch.inference_mode(),
                torch.autocast(self.runtime.device, dtype=torch.bfloat16, enabled=self.runtime.half),
            ):
                yield
        finally:
            torch.set_num_threads(before)

    def inputs(self, **given: Any) -> dict[str, Any]:
        """Prepare pictures, words or boxes, on the device."""
        made = self.processor(**given, return_tensors="pt")
        return {name: value.to(self.runtime.device) for name, value in made.items()}


@lru_cache(maxsize=4)
def load_network(kind: Kind, weights: str, runtime: Runtime) -> Network:
    """Load a network with the weights of a folder, or of an id on the Hugging Face hub; once per process.

    Raises MissingDependencyError without the extra `sam`; InputError if the weights cannot be loaded or are another
    network's, or there is no such device.
    """
    torch, transformers = _libraries()
    if runtime.device == "cuda" and not torch.cuda.is_available():
        raise InputError(
            "device is cuda, but torch finds no NVIDIA GPU here, or was built without CUDA: use device cpu, or "
            "install torch and torchvision as https://pytorch.org/get-started says."
        )
    folder = Path(weights).expanduser()
    is_folder = bool(weights) and folder.is_dir()
    if not is_folder and (weights.count("/") != 1 or weights[0] in "~./"):
        raise InputError(
            f"There is no folder '{weights}' with weights: give one, or an id such as facebook/sam2.1-hiera-tiny."
        )
    try:
        made_by, made_as = (getattr(transformers, name) for name in (kind.processor, kind.model))
    except (AttributeError, ImportError) as error:
        raise MissingDependencyError(
            f"{kind.title} in transformers {transformers.__version__}", extra_remedy("sam")
        ) from error
    try:
        place = str(folder) if is_folder else weights
        processor = made_by.from_pretrained(place)
        model, report = made_as.from_pretrained(place, output_loading_info=True)
    except Exception as error:  # a stranger's files may fail in any way
        first, *_ = f"{type(error).__name__}: {error}".strip().splitlines()
        text = (
            f"The weights '{weights}' of {kind.title} cannot be loaded ({first.split('. ')[0].rstrip('.')})."
        )
        if not is_folder:
            text += (
                f" If they are gated, ask for access at https://huggingface.co/{weights}, then run `hf auth login`. "
                f"Without a network here, run `hf download {weights} --local-dir DIR` where there is one, and name the "
                "folder instead."
            )
        raise InputError(f"{text} docs/networks.md has more.") from error
    missing, arrays = len(report["missing_keys"]), len(model.state_dict())
    if missing > _MOST_MISSING * arrays:
        raise InputError(
            f"The weights '{weights}' are not {kind.title}'s: {missing} of its {arrays} arrays are missing."
        )
    return Network(processor, model.to(runtime.device).eval(), torch, runtime)


def _libraries() -> tuple[Any, Any]:
    """Import torch and transformers, with torchvision, by which transformers prepares pictures."""
    try:
        import torch
        import torchvision  # noqa: F401
        import transformers
    except ImportError as error:
        what = f"{error.name or 'A library'}, which segmentation networks need,"
        raise MissingDependencyError(what, extra_remedy("sam")) from error
    except (RuntimeError, OSError) as error:  # built for another torch
        raise MissingDependencyError(f"A torchvision that fits torch ({error})", _ONE_INDEX) from error
    return torch, transformers
