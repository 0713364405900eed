"""Make a ready task planner from its name and that of the model that it asks."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from torc.errors import InputError
from torc.registry.context import BuildContext, parameters
from torc.registry.kinds import CLIENTS, TASK_PLANNERS
from torc.registry.loading import load_part, make_part, make_with, part_paths, shipped_paths
from torc.specs.trial import PlannerSpec
from torc.task_planning.protocol import TaskPlanner
from torc.vlm.cache import CacheConfig, CachedClient, CacheMode
from torc.vlm.config import DEFAULT_QUESTIONS, VlmConfig
from torc.vlm.picture_config import PictureConfig
from torc.vlm.protocol import VlmClient
from torc.vlm.simulated.situation import Situation

Truth = Callable[[], Situation]
"""Returns the true situation in a simulated trial."""


def make_planner(name: str, **options: Any) -> TaskPlanner:
    """Make a task planner.

    Args:
        name: a registered name, "module:Class" or "path/to/file.py:Class".
        options: arguments of its class.

    Raises:
        UnknownNameError: no planner is registered under that name.
        InputError: the class cannot be imported, does not take the arguments, or is not a planner.
    """
    planner: TaskPlanner = make_with(TASK_PLANNERS, name, options)
    return planner


def as_planner(planner: TaskPlanner | str | Callable[[], TaskPlanner]) -> TaskPlanner:
    """Return a task planner from its name, its class, or itself. Raises InputError for anything else."""
    if isinstance(planner, str):
        return make_planner(planner)
    made: Any = planner
    if isinstance(made, type) or (callable(made) and not hasattr(made, "decide")):
        made = made()
    if not isinstance(made, TaskPlanner) or not isinstance(made.name, str) or not made.name:
        raise InputError(
            f"{planner!r} is not a task planner: pass a name, or an object or class with a `name` and a method "
            "`decide(context, rng)`."
        )
    return made


def load_planner(name: str) -> Any:
    """Return what makes the planner of that name, imported but not called. Raises as `make_planner`."""
    return load_part(TASK_PLANNERS, name)


def make_spec_planner(spec: PlannerSpec, cache: CacheConfig | None, truth: Truth | None) -> TaskPlanner:
    """Make the planner of a trial; arguments as for `open_client`. Raises InputError if that is not possible."""
    context = planner_context(spec.name, load_planner(spec.name), spec.vlm, cache, truth)
    planner: TaskPlanner = make_part(TASK_PLANNERS, spec.name, spec.settings, context)
    return planner


def asks_model(maker: Any) -> bool:
    """Return whether a planner, by the class that makes it, can ask a model."""
    return TASK_PLANNERS.traits(maker).asks_model or "client" in parameters(maker)


def asking_planners() -> list[str]:
    """Return the names of the shipped planners that ask a model, for messages."""
    names = shipped_paths(TASK_PLANNERS)
    return [name for name in names if TASK_PLANNERS.traits(load_planner(name)).asks_model]


def is_reference(name: str) -> bool:
    """Return whether a shipped planner is privileged, and so is not ranked."""
    return name in shipped_paths(TASK_PLANNERS) and TASK_PLANNERS.traits(load_planner(name)).privileged


def planner_context(
    name: str, maker: Any, config: VlmConfig | None, cache: CacheConfig | None, truth: Truth | None = None
) -> BuildContext:
    """Return the client and the way to ask that a planner is given. Raises InputError for what it does not take."""
    if config is None:
        return BuildContext()
    if not asks_model(maker):
        raise InputError(
            f"{name} asks no model: leave out --vlm, or choose one of {', '.join(asking_planners())}."
        )
    if config.words and "asking" not in parameters(maker):
        raise InputError(
            f"{name} takes no `asking`, so it ignores pictures and prompts ({', '.join(config.words)}): leave them out."
        )
    return BuildContext(client=open_client(config, cache, truth), asking=config.asking)


def open_client(config: VlmConfig, cache: CacheConfig | None = None, truth: Truth | None = None) -> VlmClient:
    """Open a client of the model, with its cache if there is one. Replaying needs neither a key nor the client's code.

    Only the simulated VLM receives `truth`, and needs it. Raises InputError if the client cannot be made, and if there
    is no key or no cache to replay.
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
    # Only planners use these; a client needs none of them.
    asked = replace(config, picture=PictureConfig(), prompt=None, prices=None, questions=DEFAULT_QUESTIONS)
    plain = config.third_party and asked == VlmConfig(config.provider, "")
    if not plain and "config" not in parameters(load_part(CLIENTS, config.provider)):
        raise InputError(
            f"The VLM client '{config.provider}' takes no `config`, so it can be given no model, URL or option."
        )
    context = BuildContext(config=config, truth=truth if config.simulated else None)
    client: VlmClient = make_with(CLIENTS, config.provider, {}, context)
    return client


def spec_of_object(spec: PlannerSpec, planner: TaskPlanner) -> PlannerSpec:
    """Return the spec to record for a trial that a ready-made planner plays.

    It is `spec` if that names the planner's class, else the planner's own name. Raises InputError if the record would
    be wrong: settings or a VLM that the planner never got, or another planner's name.
    """
    cls, name = type(planner), TASK_PLANNERS.traits(planner).name
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise InputError(f"Task planner {cls.__qualname__} needs a `name`: a line of text for tables.")
    if spec.settings:
        raise InputError(
            f"The settings {', '.join(spec.settings)} do not reach a planner that is made already: give them to "
            f"{cls.__qualname__} itself, or leave out `planner` and name it in the spec."
        )
    known = part_paths(TASK_PLANNERS)
    if spec.name in known and load_planner(spec.name) is cls:
        return spec
    if spec.name not in known and spec.name.endswith(f":{cls.__qualname__}"):
        return spec
    if name in known and (other := load_planner(name)) is not cls:
        path = f"{other.__module__}:{other.__qualname__}"
        raise InputError(
            f"'{name}' is the name of another task planner ({path}): give {cls.__qualname__} one of its own."
        )
    if spec.vlm is not None:
        raise InputError(
            f"The spec says that {spec.asking}, but {cls.__qualname__} plays. "
            "Name it in the spec, or leave out the VLM."
        )
    return replace(spec, name=name)


def refuse_simulated(name: str) -> None:
    """Raise InputError, naming the command, for a planner that needs a simulated trial."""
    if name == "human":
        raise InputError(f"{name} needs the simulation: torc human")
    if name in part_paths(TASK_PLANNERS) and TASK_PLANNERS.traits(load_planner(name)).privileged:
        raise InputError(f"{name} needs the simulation: torc run --planner {name}")
