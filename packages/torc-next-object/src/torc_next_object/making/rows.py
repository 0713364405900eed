"""Make rows from a problem: its decisions, each with pictures, facts, and the value of every choice."""

import hashlib
import hmac
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from torc import Conditions, InputError, PlanningContext, Problem, problem_names
from torc.episode.privileged import open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.io.pictures import jpeg_bytes
from torc.objects.library import load_object
from torc.oracle.solve import MAX_PICKS
from torc.pipeline.building import System, build_system
from torc.problems.problem import problem_text
from torc.records import TARGET_ID
from torc.sim.portraits import turn_table
from torc.task_planning.relations import behind_candidates, find_adjacencies
from torc.trials.trial import situation_of
from torc.vlm.picture_config import PictureConfig
from torc.vlm.pictures import drawn_pictures
from torc.vlm.question_facts import grasp_facts, gripper_sentence, target_size_sentence
from torc.vlm.simulated.situation import Situation
from torc_next_object.making.baselines import baseline_choices
from torc_next_object.making.known_values import KnownValues
from torc_next_object.making.looks import Looks
from torc_next_object.making.numbering import drawn_numbers, renumbered
from torc_next_object.making.pricing import Price, first_tries
from torc_next_object.making.valuing import value_choices
from torc_next_object.making.visits import visits
from torc_next_object.prompting import VERSIONS
from torc_next_object.schema import MOST_CHOICES, NextObjectRow, best_numbers, random_value

PUBLIC_KEY = "torc-next-object"
PICTURE = PictureConfig(marks="outlines", plain=True, crop_px=24, longest_side_px=768)
"""Pictures of the first questions."""
_CLEAR_PICTURE = PictureConfig(marks="clear", plain=True)
TEST_SHARE = 0.5
_SIDES, _SIDE_PX = 2, 160
_WHITE = 255
_DIGITS = 4


@dataclass(frozen=True)
class MakingConfig:
    """How rows are made.

    Attributes:
        key: of all hashes and draws; a secret one if nobody else should be able to make the rows.
        hidden: all rows are of the split "hidden".
        per_problem: largest number of decisions per problem.
        most_looks: looks per search for values; more narrow the intervals. 0 makes only the decisions whose values are
            known.
        questions: version of the questions; the leaderboard compares version 1.
    """

    key: str = PUBLIC_KEY
    hidden: bool = False
    per_problem: int = 5
    most_looks: int = 40
    questions: int = 1

    def __post_init__(self) -> None:
        if self.questions not in VERSIONS:
            raise InputError(f"There are no questions of version {self.questions}; there are {VERSIONS}.")
        if self.per_problem < 1 or self.most_looks < 0:
            raise InputError("--per-problem must be at least 1, --looks at least 0.")

    def digest(self, *parts: str) -> str:
        """Return a hash that reveals nothing of the parts."""
        message = "\x00".join(parts).encode()
        return hmac.new(self.key.encode(), message, hashlib.sha256).hexdigest()[:24]


class RowMaker:
    """Makes rows, problem by problem."""

    def __init__(self, config: MakingConfig, known: KnownValues | None = None) -> None:
        self.config, self._known = config, known or KnownValues(None)

    def scene(self, problem: Problem) -> str:
        """Return the key that a problem's rows share."""
        return self.config.digest("scene", problem_text(problem))

    def rows(self, problem: Problem, made: Callable[[str], bool]) -> Iterator[NextObjectRow]:
        """Yield a problem's rows, except those that are `made`, by their id.

        Raises InputError if the problem has no target, and PhysicsError.
        """
        if problem.absent:
            raise InputError(f"{problem.name}: its target is absent, so no order leads to it.")
        config, scene = self.config, self.scene(problem)
        system, episode = _system(problem.workspace), EpisodeConfig(MAX_PICKS, 0)
        with ExitStack() as stack:
            # Pictures in color take long, and the search for values needs none.
            looks = Looks(stack.enter_context(open_sandbox(problem, system, episode)))
            seeing = Looks(stack.enter_context(open_sandbox(problem, system, episode, color=True)))
            references = _references(problem)
            for gone in visits(looks.context, config.per_problem, self._rng(scene)):
                key = config.digest("row", scene, *map(str, sorted(gone)))
                if made(key):
                    continue
                context, truth = seeing.context_and_truth(gone)
                if len(context.scene.ids) > MOST_CHOICES or len(context.graspable_ids) < 2:
                    continue
                values = self._known.get(key)
                if values is None:
                    if config.most_looks == 0:
                        continue
                    visible, first = context.scene.ids, first_tries(looks.context(gone))
                    found = value_choices(looks, gone, visible, config.most_looks, first)
                    if not any(found.orders.values()):
                        continue
                    values = found.values
                    self._known.add(key, values)
                part = _Decision(context, situation_of(context, truth), values, len(gone))
                yield self._row(problem, key, part, references)

    def _rng(self, key: str) -> np.random.Generator:
        return np.random.default_rng(list(bytes.fromhex(self.config.digest("draws", key))))

    def _row(
        self, problem: Problem, key: str, part: "_Decision", references: tuple[bytes, ...]
    ) -> NextObjectRow:
        rng, scene = self._rng(key), self.scene(problem)
        to_number = drawn_numbers(part.context.scene.ids, rng)
        shown = renumbered(part.context, to_number)
        second = self.config.questions >= 2
        images = drawn_pictures(shown.scene, _CLEAR_PICTURE if second else PICTURE)
        numbers = shown.scene.ids
        back = {number: k for k, number in to_number.items()}
        prices = [part.values[back[n]] for n in numbers]
        values = tuple(round(p.mean, _DIGITS) for p in prices)
        graspable = tuple(n in shown.graspable_ids for n in numbers)
        told = told_of(shown)
        relations = [(r["source"], r["target"]) for r in json.loads(told["relations"])]
        chosen = baseline_choices(part.context, part.situation, rng)
        chosen["first"] = min(numbers)
        return NextObjectRow(
            id=key,
            split="hidden" if self.config.hidden else split_of(problem, scene),
            scene=scene,
            source=source_of(problem),
            category=problem.category,
            picks_taken=part.picks_taken,
            target_hidden=told["target_hidden"],
            description=problem.description,
            image=jpeg_bytes(images["marked"]),
            image_plain=jpeg_bytes(images["plain"]),
            references=references,
            numbers=numbers,
            graspable=graspable,
            facts="\n".join(grasp_facts(shown, counted=True)) if second else told["facts"],
            relations=told["relations"],
            relations_true=tuple(_is_behind(part.situation, back[s], back[t]) for s, t in relations),
            values=values,
            values_low=tuple(min(v, round(p.low, _DIGITS)) for v, p in zip(values, prices)),
            values_high=tuple(max(v, round(p.high, _DIGITS)) for v, p in zip(values, prices)),
            best=best_numbers(numbers, values),
            random_value=round(random_value(graspable, values), _DIGITS),
            baselines=json.dumps(
                {name: to_number.get(k) if k is not None else None for name, k in chosen.items()}
            ),
            questions=self.config.questions,
            gripper=gripper_sentence(shown) if second else "",
            target_size=target_size_sentence(shown) if second else "",
        )


@cache
def _system(workspace: str) -> System:
    """Build the parts around a problem in this workspace (or the default one), once."""
    return build_system(Conditions().at(workspace))


@dataclass(frozen=True)
class _Decision:
    """A look and what is known of it, by the simulator's ids."""

    context: PlanningContext
    situation: Situation
    values: Mapping[int, Price]
    picks_taken: int


def told_of(context: PlanningContext) -> dict[str, Any]:
    """Return the columns of a row that describe a look in prompts."""
    behind = behind_candidates(find_adjacencies(context.scene))
    relations = [{"source": r.source, "relation": "behind", "target": r.target} for r in behind]
    return {
        "numbers": context.scene.ids,
        "target_hidden": TARGET_ID not in context.scene.ids,
        "facts": "\n".join(grasp_facts(context)),
        "relations": json.dumps(relations),
    }


def source_of(problem: Problem) -> str:
    """Return "torc40", "hard" (one of the harder families), or "generated"."""
    if problem.name in problem_names("torc40"):
        return "torc40"
    of_family = problem.origin.get("wanted_family") or problem.origin.get("family")
    return "hard" if of_family or problem.name in problem_names("torc-hard") else "generated"


def split_of(problem: Problem, scene: str) -> str:
    """Return "test" for torc40, on which planners are compared, and for part of the others; else "train"."""
    in_test = source_of(problem) == "torc40" or int(scene[:8], 16) / 16**8 < TEST_SHARE
    return "test" if in_test else "train"


def _is_behind(situation: Situation, source: int, front: int) -> bool:
    """Check that `front` hides part of `source` or blocks its grasps, and neither lies on the other."""
    stacked = {(source, front), (front, source)} & situation.lies_on
    return not stacked and ((front, source) in situation.hides or (front, source) in situation.blocks)


def _references(problem: Problem) -> tuple[bytes, ...]:
    """Return pictures of the target from the front and the back, on white."""
    model = load_object(problem.ordered()[TARGET_ID].model)
    pictures = turn_table(model, _SIDES, _SIDE_PX)
    return tuple(jpeg_bytes(np.where(p[..., 3:] > 0, p[..., :3], _WHITE).astype(np.uint8)) for p in pictures)
