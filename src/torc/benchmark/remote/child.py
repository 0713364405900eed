"""What the child process on another machine does: finds the user's files, and plays."""

import os
import pickle
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from torc.benchmark.playing import Order, changed_part
from torc.benchmark.remote.errand import Unfit
from torc.benchmark.remote.trip import Trip
from torc.benchmark.spec import PlannedTrial
from torc.errors import InputError
from torc.scenes.object_store import ENVIRONMENT_VARIABLE


def play_trip(trip: Trip) -> Any:
    """What the work returns, or Unfit if the planner here is another one. Raises as the work."""
    # Before the cargo is opened: work may be the user's.
    os.environ[ENVIRONMENT_VARIABLE] = str(trip.objects)
    if str(trip.code) not in sys.path:
        sys.path.append(str(trip.code))
    work, order = pickle.loads(trip.cargo)
    return _other_part(order.trial) or work(_moved(order, trip))


def _moved(order: Order, trip: Trip) -> Order:
    problem = order.problem if trip.problem is None else str(trip.problem)
    return replace(order, work=Path(trip.directory), problem=problem)


def _other_part(trial: PlannedTrial) -> Unfit | None:
    try:
        changed = changed_part(trial)
    except InputError as error:
        return Unfit(f"{error} Install the planner there, or start where its file is.")
    return Unfit(f"The file of the {changed} differs there. Install the same one.") if changed else None
