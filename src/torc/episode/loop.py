"""The episode: one pick after another until the target is out (paper: A Modular Pipeline)."""

from collections.abc import Sequence

from torc.episode.events import Decided, Ended, EpisodeResult, Event, Listener, Started
from torc.episode.steps import EpisodeConfig, EpisodeParts, PickParts, Steps, pick_request
from torc.episode.stepwise import Episode
from torc.pipeline.look import Look
from torc.pipeline.seeding import stage_rng
from torc.pipeline.warm_up import rehearse_look
from torc.plugins import warm_up
from torc.task_planning.asking import ask_planner, rehearse_planner


def run_episode(
    parts: EpisodeParts,
    started: Started,
    config: EpisodeConfig,
    listeners: Sequence[Listener] = (),
) -> EpisodeResult:
    """Pick until the target is retrieved or lost, the budget is spent, or nothing is left to try.

    Args:
        parts: robot, pipeline, task planner and motion planner.
        started: who tries what; told to the listeners first.
        config: budget and seed.
        listeners: called with every event, in order.

    Raises:
        PhysicsError and other TorcErrors of the parts: the trial is errored, no result.
    """

    def tell(event: Event) -> None:
        for listener in listeners:
            listener(event)

    tell(started)
    episode = Episode(Steps(parts.picking, started.target_description, config, tell))
    while (look := episode.look()) is not None:
        pick = episode.state.pick
        with episode.steps.clock.stage("decide") as lap:
            rng = stage_rng(config.seed, pick, "decide")
            decision = ask_planner(parts.task_planner, look.context, rng)
        tell(Decided(pick, look, decision, lap.seconds))
        episode.pick(look, decision)
    result = episode.result()
    tell(Ended(result))
    return result


def rehearse(parts: EpisodeParts) -> Look:
    """Use every kernel of the parts once, on a made-up scene: what is compiled or loaded now is no planning time.

    Returns:
        The look at that scene, for whoever has kernels of his own to rehearse.
    """
    look = rehearse_picks(parts.picking)
    rehearse_planner(parts.task_planner, look.context)
    return look


def rehearse_picks(parts: PickParts) -> Look:
    """The same without a task planner."""
    look = rehearse_look(parts.pipeline, parts.robot.description.arm.rest_qpos)
    for object_id in look.context.scene.ids[:1]:
        warm_up(parts.motion_planner, pick_request(look, object_id))
    return look
