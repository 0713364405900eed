"""The protocol of task planners: one method that names the next object to pick."""

from typing import Protocol, runtime_checkable

import numpy as np

from torc.records import Decision, PlanningContext


@runtime_checkable
class TaskPlanner(Protocol):
    """Decides which object to pick next.

    `torc.testing.planner_conformance` checks an implementation against these rules:

    - `decide` names a visible object with a valid grasp, or None if it found no such choice;
    - it asks its chooser (a model, a person) at most MAX_ATTEMPTS times, and reports how often in `attempts`;
    - all its randomness comes from `rng`; the context is read only;
    - `evidence.notes` is plain data that `json.dumps` accepts.

    A planner with its own numba kernels may have a second method, `warm_up(context)`: it is called before a trial with
    a made-up context, to run each kernel once, so that compilation never counts as decision time.
    """

    @property
    def name(self) -> str:
        """Name in reports and on the command line."""
        ...

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the next object to pick, and why."""
        ...


MAX_ATTEMPTS = 3
"""How often a chooser may be asked per pick before the pick is lost (the authors' rule)."""
