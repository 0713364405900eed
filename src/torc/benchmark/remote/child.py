"""What the child process on another machine does: finds the user's files, and plays."""

import os
import pickle
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from torc.benchmark.identity import part_source
from torc.benchmark.playing import Order
from torc.benchmark.remote.errand import Unfit
from torc.benchmark.remote.trip import Trip
from torc.benchmark.spec import BenchPlanner, Settings
from torc.errors import InputError
from torc.grasping.registry import GRASP_PLANNERS
from torc.plugins import load_part
from torc.scenes.object_store import ENVIRONMENT_VARIABLE
from torc.task_planning.registry import load_planner_class


def play_trip(trip: Trip) -> Any:
    """What the work returns, or Unfit if the planner here is another one. Raises as the work."""
    # Before the cargo is opened: work may be the user's.
    os.environ[ENVIRONMENT_VARIABLE] = str(trip.objects)
    if str(trip.code) not in sys.path:
        sys.path.append(str(trip.code))
    work, order = pickle.loads(trip.cargo)
    trial = order.trial
    unfit = _other_planner(trial.planner) or _other_grasps(trial.settings)
    return unfit or work(_moved(order, trip))


def _moved(order: Order, trip: Trip) -> Order:
    problem = order.problem if trip.problem is None else str(trip.problem)
    return replace(order, work=Path(trip.directory), problem=problem)


def _other_planner(planner: BenchPlanner) -> Unfit | None:
    if not planner.source:
        return None
    try:
        here = part_source(load_planner_class(planner.name))
    except InputError as error:
        return _missing(error)
    return None if here == planner.source else _differs("planner", planner.name)


def _other_grasps(settings: Settings) -> Unfit | None:
    if not settings.grasps_source:
        return None
    try:
        here = part_source(load_part(GRASP_PLANNERS, settings.grasps))
    except InputError as error:
        return _missing(error)
    return None if here == settings.grasps_source else _differs("grasp planner", settings.grasps)


def _missing(error: InputError) -> Unfit:
    return Unfit(f"{error} Install the planner there, or start where its file is.")


def _differs(what: str, name: str) -> Unfit:
    return Unfit(f"The file of the {what} '{name}' differs there. Install the same one.")
