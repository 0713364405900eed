"""ORACLE as a task planner: the upper bound of every comparison. Its privilege is to know the simulation."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from torc.episode.bound import Bound
from torc.episode.privileged import SimulatedState, Simulation
from torc.errors import InputError
from torc.oracle.answer import OracleAnswer, answer_from
from torc.oracle.solve import best_order
from torc.oracle.tree import DEFAULT_BUDGET, GIVE_UP, Path, check_budget
from torc.records import Decision, Evidence, PlanningContext
from torc.registry.kinds import TaskPlannerTraits
from torc.task_planning.dg_select import DgSelectPlanner


@dataclass(frozen=True)
class _Plan:
    """An order of picks that is being followed, and the index of its next step."""

    path: Path[SimulatedState]
    answer: OracleAnswer
    step: int = 0

    @property
    def ended(self) -> bool:
        return self.step >= len(self.path.choices)


class OraclePlanner(TaskPlannerTraits):
    """Tries out orders of picks before the first one, and then picks in the best order that it found.

    It searches again if the trial does not go as foreseen, and if the order ends without the target.
    """

    name = "oracle"
    reads_picture = False
    privileged = True

    def __init__(self, budget: float = DEFAULT_BUDGET) -> None:
        check_budget(budget)
        self.budget = budget
        self._simulation: Simulation | None = None
        self._plan: _Plan | None = None
        self._bound: Bound | None = None

    @property
    def bound(self) -> Bound:
        """Certainty for the trial as played: the first search's, if all went as foreseen from there to the end."""
        return self._bound or Bound.FOUND

    def attach(self, simulation: Simulation) -> None:
        self._simulation, self._plan, self._bound = simulation, None, None

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the next object of the best order; draws nothing from rng. Raises InputError without a simulation."""
        if self._simulation is None:
            raise InputError(
                "The planner 'oracle' tries picks out in the simulation, so it decides in simulated trials only: "
                "torc run --planner oracle."
            )
        now, plan = self._simulation.now(), self._plan
        if plan is None or plan.ended or not plan.path.states[plan.step].same_as(now):
            simulation, config = self._simulation, self._simulation.config
            left = config.max_picks - now.episode.pick
            # A trial needs the order; the proof that it is the best only if it costs little.
            found = best_order(
                simulation.sandbox, now, left, self.budget, simulation.say, likely_suffices=True
            )
            answer = answer_from(found, simulation.problem, config.seed, self.budget)
            plan = _Plan(found.best or found.outlook, answer)
            # After a second search the trial has not followed one answer from the start.
            self._bound = plan.answer.bound if self._bound is None and plan.answer.solved else Bound.FOUND
        self._plan = replace(plan, step=plan.step + 1)
        notes: dict[str, Any] = {"bound": self.bound.value, "foreseen": plan.answer.to_dict()}
        if plan.ended:
            # Nothing that was tried brought the target any nearer.
            decision = DgSelectPlanner().decide(context, rng)
            reason = f"{plan.answer.verdict()} By the dependency graph: {decision.reason}"
            return replace(decision, reason=reason, evidence=Evidence(notes=notes))
        evidence = Evidence(notes=notes | {"step": plan.step})
        if plan.path.choices[plan.step] == GIVE_UP:
            reason = "The target is not there: there is no place left that nobody has seen and that it would fit into."
            return Decision(None, reason, give_up=True, evidence=evidence)
        return Decision(plan.path.choices[plan.step], _reason(plan.answer, plan.step), evidence=evidence)


def _reason(answer: OracleAnswer, step: int) -> str:
    pick = answer.foreseen[step]
    what = f"Pick {pick.object_id} ({pick.name})" if pick.object_id is not None else "Nothing can be picked"
    if step:
        return f"{what}: pick {step + 1} of the {answer.picks} foreseen."
    rest = "".join(f", then {name}" for name in answer.order[1:])
    beginning = "" if answer.solved else " This is the most promising beginning."
    return f"{what}{rest}: {answer.verdict()}{beginning}"
