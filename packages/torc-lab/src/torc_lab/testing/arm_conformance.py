"""Check what every arm driver must do, best on a twin: `check_arm_driver(lambda: MyDriver(...))`."""

import time
from collections.abc import Callable

import numpy as np

from torc import TorcError
from torc.registry.kinds import ARM_DRIVERS
from torc.testing.conformance import require, trait_faults
from torc_lab.checks import turning
from torc_lab.protocols import AT_ONCE_S, ArmDriver, LabError, missing_methods, state_faults

_TURN_RAD, _MOTION_S = 0.05, 1.0
_ENDS_S, _ARRIVED_RAD = 3.0, 0.01


def check_arm_driver(connect: Callable[[], ArmDriver]) -> None:
    """Turn the first joint by 0.05 rad and back, stop a motion halfway, and end the connection. **The arm moves.**

    It must be at rest and allow motions.

    Args:
        connect: makes a connection.

    Raises:
        NonConformanceError: names everything that is broken.
    """
    driver = connect()
    if missing := missing_methods(driver, ArmDriver):
        require("arm driver", [f"it lacks {', '.join(missing)} of torc_lab.protocols.ArmDriver"])
    try:
        found = [*trait_faults(ARM_DRIVERS, driver), *state_faults(driver)]
        require("arm driver", found)
        found = [*_lets_motions_in(driver), *_moves(driver), *_stops(driver)]
    finally:
        driver.close()
    require("arm driver", [*found, *_is_closed(driver)])


def _lets_motions_in(driver: ArmDriver) -> list[str]:
    status = driver.status()
    if status.stopped or status.moving:
        return [f"an arm at rest that may move says '{status.stopped or 'moving'}'"]
    return []


def _moves(driver: ArmDriver) -> list[str]:
    found = []
    for by_rad in (_TURN_RAD, -_TURN_RAD):
        here = driver.status().qpos
        driver.start(turning(here, by_rad))
        if driver.ended() is not None or not _within(_ENDS_S, lambda: driver.status().moving):
            found.append("after start() it must move, and ended() be None")
        if not _within(_MOTION_S + _ENDS_S, lambda: driver.ended() is not None) or driver.ended() != "":
            found.append(f"ended() must become '' at the end, not {driver.ended()!r}")
        goal = here + by_rad * np.eye(len(here))[0]
        if not _within(_ENDS_S, lambda: np.abs(driver.status().qpos - goal).max() < _ARRIVED_RAD):  # noqa: B023
            found.append("it did not arrive")
        if not _within(_ENDS_S, lambda: not driver.status().moving):
            found.append("it moves on and on")
    return found


def _stops(driver: ArmDriver) -> list[str]:
    found = []
    here = driver.status().qpos
    driver.start(turning(here, _TURN_RAD))
    time.sleep(0.4 * _MOTION_S)
    began = time.monotonic()
    driver.stop()
    driver.stop()
    if time.monotonic() - began > 2 * AT_ONCE_S:
        found.append("stop() must return at once, also when it is called twice")
    if not _within(_ENDS_S, lambda: driver.ended() is not None):
        found.append("ended() must say so after stop()")
    if not _within(_ENDS_S, lambda: not driver.status().moving):
        found.append("it moves on after stop()")
    rests = driver.status().qpos
    time.sleep(0.3)
    gone, after = abs(rests[0] - here[0]), np.abs(driver.status().qpos - rests).max()
    if gone > 0.9 * _TURN_RAD or after > 0.1 * _TURN_RAD:
        found.append("stop() did not stop it")
    return found


def _is_closed(driver: ArmDriver) -> list[str]:
    """Return faults if the driver still answers after its connection has ended."""
    found = []
    for name, call in (("status", driver.status), ("ended", driver.ended)):
        try:
            call()
            found.append(f"{name}() must raise LabError once the connection is lost")
        except LabError:
            continue
        except TorcError as error:
            found.append(f"{name}() raises {type(error).__name__}, not LabError")
    return found


def _within(seconds: float, holds: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if holds():
            return True
        time.sleep(0.005)
    return bool(holds())
