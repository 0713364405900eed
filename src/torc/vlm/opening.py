"""From a configuration to a client that is ready to be asked."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from torc.errors import InputError
from torc.plugins import make_part, parameters, refuses, takes
from torc.stages import ASKING
from torc.vlm.cache import CacheConfig, CachedClient, CacheMode
from torc.vlm.config import CLIENTS, DEFAULT_QUESTIONS, VlmConfig
from torc.vlm.picture_config import PictureConfig
from torc.vlm.protocol import VlmClient
from torc.vlm.simulated.situation import Situation

Truth = Callable[[], Situation]
"""Tells what is true now, in a simulated trial."""


def planner_options(
    name: str, maker: Any, config: VlmConfig | None, cache: CacheConfig | None, truth: Truth | None = None
) -> dict[str, Any]:
    """The options of a planner (its name, and what makes it) that asks this model: the `client`, and, if it takes it,
    `asking`; none without a model. Raises InputError for a planner that asks no model, for pictures or a prompt that it
    does not take, and as `open_client`.
    """
    if config is None:
        return {}
    if refuses(maker, "client"):
        raise InputError(f"{name} asks no model: leave out --vlm, or choose one of {', '.join(ASKING)}.")
    takes_asking = "asking" in parameters(maker)
    if config.words and not takes_asking:
        raise InputError(
            f"{name} takes no `asking`, so it cannot be told of pictures and prompts ({', '.join(config.words)})."
        )
    asking = {"asking": config.asking} if takes_asking else {}
    return {"client": open_client(config, cache, truth), **asking}


def open_client(config: VlmConfig, cache: CacheConfig | None = None, truth: Truth | None = None) -> VlmClient:
    """A client of the model, with its cache if there is one; `truth` is for the simulated VLM and for nobody else.
    Replaying needs neither key nor somebody else's client.

    Raises InputError without a key or a cache to replay, for the simulated VLM without a truth to tell, and for a
    client that cannot be made.
    """
    if config.simulated and truth is None:
        raise InputError(
            "The simulated VLM answers from the simulator's truth, and here is no simulation. Use it in simulated "
            "trials (torc run --planner vlm-select --vlm simulated), or name a model, e.g. --vlm gemini:MODEL."
        )
    if cache is None or cache.mode is CacheMode.OFF:
        return _open(config, truth)
    if cache.mode is CacheMode.REPLAY:
        return CachedClient(config, cache.directory)
    return CachedClient(config, cache.directory, _open(config, truth))


def _open(config: VlmConfig, truth: Truth | None) -> VlmClient:
    offered = {"config": config} | ({"truth": truth} if config.simulated else {})
    # What planners alone go by is nothing that a client must be told.
    asked = replace(config, picture=PictureConfig(), prompt=None, prices=None, questions=DEFAULT_QUESTIONS)
    plain = config.third_party and asked == VlmConfig(config.provider, "")
    if not plain and not takes(CLIENTS, config.provider, "config"):
        raise InputError(
            f"The VLM client '{config.provider}' takes no `config`, so it can be told no model, URL or option."
        )
    client: VlmClient = make_part(CLIENTS, config.provider, {}, offered)
    return client
