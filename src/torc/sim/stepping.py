"""Run the world in control periods, with the watchdog and an observer."""

from collections.abc import Callable

import mujoco

from torc.sim.simulated_world import World
from torc.sim.watchdog import Watchdog

Observer = Callable[[World], None]
"""Observes the world at intervals, e.g. to record a video; must change nothing."""


_CONTROL_S = 0.004
"""Time between two commands to the servos, and between two readings of contact forces."""
_WATCHDOG_S, _OBSERVER_S = 0.02, 1.0 / 25.0


StepperState = tuple[int, float | None]
"""What a stepper remembers: the number of control periods so far, which schedules the watchdog, and since when two
bodies have been too deep in each other (None if they are not).
"""


class Stepper:
    """Steps a world. Nothing else advances time while a robot works."""

    def __init__(self, world: World, observer: Observer | None = None) -> None:
        self.world, self._observer = world, observer
        self._watchdog = Watchdog(world)
        timestep = world.model.opt.timestep
        self._steps = max(1, round(_CONTROL_S / timestep))
        self.period_s: float = self._steps * timestep
        """Time that one call of `step` takes."""
        self._watch_every = max(1, round(_WATCHDOG_S / self.period_s))
        self._observe_every = max(1, round(_OBSERVER_S / self.period_s))
        self._count = 0

    def step(self) -> None:
        """Run one control period. Raises PhysicsError if the simulation broke."""
        mujoco.mj_step(self.world.model, self.world.data, nstep=self._steps)
        self._count += 1
        if self._count % self._watch_every == 0:
            self._watchdog.check()
        if self._observer is not None and self._count % self._observe_every == 0:
            self._observer(self.world)

    def save(self) -> StepperState:
        """Return the stepper's memory."""
        return self._count, self._watchdog.deep_since_s

    def restore(self, state: StepperState) -> None:
        """Continue from a saved memory; the world must be in its state of that time, too."""
        self._count, self._watchdog.deep_since_s = state

    def run(self, seconds: float) -> None:
        """Run several control periods with the servos' commands unchanged."""
        for _ in range(max(1, round(seconds / self.period_s))):
            self.step()
