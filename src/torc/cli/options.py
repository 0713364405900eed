"""Options that several commands share: robot and workspace, the target, task planners, the VLM and how it is asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from torc.errors import InputError

if TYPE_CHECKING:
    from torc.benchmark.spec import BenchPlanner
    from torc.perception.protocol import Wanted
    from torc.vlm.cache import CacheConfig
    from torc.vlm.config import VlmConfig

RobotOption = Annotated[
    str,
    tyro.conf.arg(
        help="Robot: sda10f_2f85, ur5e_2f85, panda_hand, or a robot description file of your own (docs/robots.md)."
    ),
]
WorkspaceOption = Annotated[
    str, tyro.conf.arg(help="Table, bin and camera: paper, or a workspace file of your own (docs/robots.md).")
]
JsonOption = Annotated[bool, tyro.conf.arg(help="Print as JSON.")]


def check_picture_name(path: Path, *endings: str) -> None:
    """Raise InputError unless a picture's name has one of the endings; .jpeg counts as .jpg."""
    if path.suffix.lower().replace(".jpeg", ".jpg") not in endings:
        raise InputError(f"{path}: pictures are written as {' or '.join(endings)}. Use a name that ends so.")


def wanted_of(
    description: str,
    pictures: Sequence[Path],
    mark: str = "",
    size_m: tuple[float, float] | None = None,
    *,
    optional: bool = False,
) -> Wanted:
    """Return the target of --target, --reference, --mark and --target-size. Raises InputError if no target is given."""
    from torc.perception.protocol import Wanted
    from torc.perception.target import load_pictures

    if not (description or pictures or mark or optional):
        raise InputError(
            "Which object is the target? Give --reference pictures of it, --target its description, or both."
        )
    try:
        numbers = tuple(int(part) for part in mark.split(",")) if mark else ()
    except ValueError:
        raise InputError(f"--mark '{mark}' is not COLUMN,ROW or LEFT,TOP,RIGHT,BOTTOM in pixels.") from None
    return Wanted(description, load_pictures(pictures), numbers, size_m)


def planners_of(given: Sequence[tuple[str, dict[str, Any]]], vlm: VlmOptions) -> list[BenchPlanner]:
    """Return planners by name and settings, each with the VLM named behind it, or that of --vlm. Raises InputError."""
    from torc.benchmark.spec import find_planner, split_vlm
    from torc.specs.trial import PlannerSpec

    named = [(*split_vlm(text), settings) for text, settings in given]
    # Options of a VLM may be meant only for those named beside planners.
    for_all = vlm.config() if vlm.vlm or all(own is None for _, own, _ in named) else None
    planners = []
    for name, own, settings in named:
        spec = PlannerSpec(name, for_all if own is None else vlm.config(own), settings)
        planners.append(find_planner(spec, vlm.cache(), own_vlm=own is not None))
    return planners


@dataclass(frozen=True)
class VlmOptions:
    """The model that the planners vlm-select, vlm-grasps and vlm-fixes-dg ask.

    Keys are read from the environment only: GEMINI_API_KEY, OPENAI_API_KEY, ANTHROPIC_API_KEY, and, for a server at a
    URL that you give, TORC_VLM_API_KEY.
    """

    vlm: Annotated[str | None, tyro.conf.arg(metavar="MODEL")] = None
    """gemini:MODEL, anthropic:MODEL, openai:MODEL, or openai:MODEL@URL for vLLM, Ollama, llama-server, LM Studio
    (e.g. openai:qwen2.5-vl@http://localhost:8000/v1). simulated, or simulated:PROFILE (hopeless, poor, paper,
    good, perfect, or an accuracy such as 0.8): no model, but the simulator's truth with mistakes; for simulated trials,
    no participant in comparisons. module:Class or path/to/file.py:Class: a client of your own."""
    vlm_temperature: float | None = None
    """Sampling temperature; the model's own if not given."""
    vlm_thinking: str | None = None
    """off, minimal, low, medium, high, or a number of tokens; the model's own if not given."""
    vlm_max_tokens: int | None = None
    """Bound on a reply, thinking included."""
    vlm_seeded: bool = False
    """Send a sampling seed drawn from the trial's (not for Anthropic)."""
    vlm_free_text: bool = False
    """Ask for JSON by the prompt only, as the paper does, for servers that take no JSON schema."""
    vlm_questions: Literal[2, 3] = 2
    """Version of the questions. 3 says more (gripper, sizes, numbers of grasps, which rule wins) and sends a picture
    drawn for the question (--vlm-marks clear), unless you choose another; 2 is that of the published results."""
    vlm_marks: Literal["tinted", "outlines", "clear"] = "tinted"
    """tinted: objects tinted in colours of their own, the paper's picture; outlines: thin outlines and small numbers,
    all other colours as the camera saw them; clear: the same, drawn for the question at a higher resolution."""
    vlm_plain: bool = False
    """Send the picture without marks as well."""
    vlm_crop: Annotated[int | None, tyro.conf.arg(metavar="PX")] = None
    """Cut the picture to the objects and this margin, in pixels of the camera; the whole picture if not given."""
    vlm_longest_side: Annotated[int | None, tyro.conf.arg(metavar="PX")] = None
    """Enlarge the picture to this longest side before it is marked, e.g. 1024; as it is if not given."""
    vlm_prompt: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """A prompt of your own (.yaml or .txt, docs/vlm.md), or the name of a shipped one, e.g. vlm-select-history-1."""
    vlm_prices: Annotated[str | None, tyro.conf.arg(metavar="SENT,WRITTEN|FILE")] = None
    """Prices of a million tokens sent and written, e.g. 0.30,2.50 or 0.30,2.50,EUR, or a price table (.yaml): results
    then tell the cost."""
    vlm_timeout: float = 120.0
    """Seconds until a request is given up."""
    vlm_retries: int = 4
    """Further requests after one without a reply; then the trial is errored."""
    vlm_cache: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Directory of recorded replies."""
    vlm_cache_mode: Literal["record", "replay", "off"] = "record"
    """record: ask only for what is missing in the cache; replay: never ask, no key needed; off: always ask."""

    def config(self, named: str | None = None) -> VlmConfig | None:
        """Return the model and how it is asked; None if none is named. `named` replaces --vlm. Raises InputError."""
        from torc.vlm.config import VlmConfig, parse_thinking, parse_vlm
        from torc.vlm.picture_config import PictureConfig
        from torc.vlm.price_files import parse_prices
        from torc.vlm.prompt_files import load_prompt

        text = self.vlm if named is None else named
        if text is None:
            if self != VlmOptions():
                raise InputError("Options of a VLM are given, but no --vlm.")
            return None
        config = VlmConfig(
            *parse_vlm(text),
            temperature=self.vlm_temperature,
            thinking=parse_thinking(self.vlm_thinking),
            max_output_tokens=self.vlm_max_tokens,
            seeded=self.vlm_seeded,
            structured=not self.vlm_free_text,
            timeout_s=self.vlm_timeout,
            retries=self.vlm_retries,
            picture=PictureConfig(self.vlm_marks, self.vlm_plain, self.vlm_crop, self.vlm_longest_side),
            prompt=None if self.vlm_prompt is None else load_prompt(self.vlm_prompt),
            questions=self.vlm_questions,
        )
        prices = None if self.vlm_prices is None else parse_prices(self.vlm_prices, config.text)
        return config if prices is None else replace(config, prices=prices)

    def cache(self) -> CacheConfig | None:
        """Return where replies are kept; None if nowhere. Raises InputError."""
        from torc.vlm.cache import CacheConfig, CacheMode

        if self.vlm_cache is None:
            if self.vlm_cache_mode == "replay":
                raise InputError("--vlm-cache-mode replay needs --vlm-cache DIR.")
            return None
        return CacheConfig(self.vlm_cache, CacheMode(self.vlm_cache_mode))
