"""The closed loop as a task of inspect_ai: the model picks, the simulator plays the pick, the next picture comes back.

    inspect eval torc_next_object/retrieval -T problems=validation --model PROVIDER/MODEL --max-samples 2

Each sample is one retrieval in the simulation of `torc run`; a pick takes seconds, and a world some hundred MB.
"""

import os
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

import anyio
from inspect_ai import Task, task
from inspect_ai.dataset import MemoryDataset, Sample
from inspect_ai.model import ChatMessageUser, ContentImage, ContentText
from inspect_ai.scorer import Score, Scorer, Target, mean, scorer, stderr
from inspect_ai.solver import Generate, Solver, TaskState, solver
from inspect_ai.util import concurrency

from torc.errors import UnknownNameError
from torc_next_object.prompting import VARIANTS, prompt_name, prompt_text
from torc_next_object.replies import read_number

_FIRST = (
    "This is one of several looks: after your answer the robot tries that pick, and you are shown what is there then. "
    "It has {left} tries left.\n\n"
)
_AFTER = "The last try ended as: {ended}. {left} tries are left. This is what the camera sees now.\n\n"
_T = TypeVar("_T")


@task
def retrieval(
    problems: str = "torc40",
    seeds: int = 1,
    variant: str = "grasps",
    max_picks: int = 15,
    history: bool = True,
) -> Task:
    """Play whole retrievals. Without `history` each look is a conversation of its own, which costs fewer tokens."""
    from torc import load_problem
    from torc.problems.sets import select_problems

    if variant not in VARIANTS:
        raise UnknownNameError("variant", variant, [*VARIANTS])
    samples = [
        Sample(
            id=f"{name}-{seed}",
            input=load_problem(name).description,
            target="retrieved",
            metadata={"problem": name, "seed": seed},
        )
        for name in select_problems(problems)
        for seed in range(seeds)
    ]
    return Task(
        dataset=MemoryDataset(samples, name="torc retrieval"),
        solver=retrieve(variant, max_picks, history),
        scorer=retrieved(),
        metadata={"prompt": prompt_name(variant)},
    )


@solver
def retrieve(variant: str, max_picks: int, history: bool = True) -> Solver:
    """Look, ask, pick, until the target is delivered or lost, or no try is left."""

    async def solve(state: TaskState, generate: Generate) -> TaskState:
        problem, seed = state.metadata["problem"], int(state.metadata["seed"])
        # A world works only in the thread in which it was made: its pictures are drawn there.
        with ThreadPoolExecutor(1) as thread:
            async with concurrency("torc simulation", max(1, os.cpu_count() or 1)):
                table = await _in(thread, lambda: _Table(problem, seed, max_picks))
                try:
                    return await _played(state, generate, table, thread)
                finally:
                    await _in(thread, table.close)

    async def _played(state: TaskState, generate: Generate, table: "_Table", thread: Executor) -> TaskState:
        state.messages, invalid = [], 0
        while turn := await _in(thread, lambda: table.turn(variant)):
            if not history:
                state.messages = []
            picture, text, numbers = turn
            content = [ContentImage(image=picture), ContentText(text=text)]
            state.messages.append(ChatMessageUser(content=content))
            state = await generate(state)
            number = read_number(state.output.completion, numbers)
            invalid += number is None
            await _in(thread, partial(table.pick, number))
        state.metadata |= table.result() | {"invalid": invalid}
        state.completed = True
        return state

    return solve


@scorer(metrics={"*": [mean(), stderr()]}, name="retrieval")
def retrieved() -> Scorer:
    """Score whether the target was delivered, the picks (all there are if it was not), drops, and invalid replies.

    A simulation that broke is an error of the sample, not a failure.
    """

    async def score(state: TaskState, target: Target) -> Score:
        facts = state.metadata
        value = {name: float(facts[name]) for name in ("retrieved", "picks", "drops", "invalid")}
        return Score(value=value, answer=str(facts["end"]), explanation="; ".join(facts["outcomes"]))

    return score


class _Table:
    """One retrieval in simulation, whose looks are questions."""

    def __init__(self, problem: str, seed: int, max_picks: int) -> None:
        from torc import Conditions, load_problem
        from torc.episode.steps import EpisodeConfig
        from torc.gym_env.env import EpisodeSimulation

        loaded = load_problem(problem)
        conditions = Conditions(max_picks=max_picks).at(loaded.workspace)
        self._description, self._most = loaded.description, max_picks
        self._simulation = EpisodeSimulation(conditions, color=True)
        self._episode = self._simulation.begin(problem, EpisodeConfig(max_picks, seed))
        self._look: Any = None

    def turn(self, variant: str) -> tuple[str, str, tuple[int, ...]] | None:
        """Return the picture (a data URL), text and choices of the next question; None at the end."""
        from torc.io.pictures import data_url, jpeg_bytes
        from torc.vlm.pictures import drawn_pictures
        from torc_next_object.making.rows import PICTURE, told_of

        self._look = self._episode.look()
        if self._look is None:
            return None
        context = self._look.context
        outcomes = self._episode.state.outcomes
        ended = outcomes[-1].result.value if outcomes else ""
        words = (_AFTER if outcomes else _FIRST).format(ended=ended, left=self._most - len(outcomes))
        row = told_of(context) | {"description": self._description, "references": ()}
        marked = drawn_pictures(context.scene, PICTURE)["marked"]
        return data_url(jpeg_bytes(marked)), words + prompt_text(row, variant), context.scene.ids

    def pick(self, number: int | None) -> None:
        """Play the pick; without a number the try is lost."""
        from torc import Decision

        self._episode.pick(self._look, Decision(number, "the model's choice"))

    def result(self) -> dict[str, Any]:
        """Return the result as the sample's metadata."""
        from torc.pipeline.state import EndReason

        state, end = self._episode.state, self._episode.end
        got = end is EndReason.RETRIEVED
        return {
            "end": end.value if end else "",
            "retrieved": got,
            "picks": state.pick if got else self._most,
            "drops": len(state.dropped),
            "outcomes": [f"{o.object_id}: {o.result.value}" for o in state.outcomes],
        }

    def close(self) -> None:
        """Free the world."""
        self._simulation.close()


async def _in(thread: Executor, work: Callable[[], _T]) -> _T:
    """Work in that thread while other samples go on."""
    return await anyio.to_thread.run_sync(lambda: thread.submit(work).result())
