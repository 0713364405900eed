"""Rules that a driver of an arm must keep while nothing moves. `torc lab check` looks first whether it does."""

import time
from itertools import pairwise

import numpy as np

from torc_lab.protocols import ArmDriver, ArmStatus, missing_methods

AT_ONCE_S = 0.05
"""A method that does not wait returns within this time."""
_LOOKS, _APART_S = 40, 0.01


def state_faults(driver: ArmDriver) -> list[str]:
    """Rules that a driver breaks by what it says of its state; nothing moves. `torc lab check` asks this first."""
    if missing := missing_methods(driver, ArmDriver):
        return [f"it lacks {', '.join(missing)} of torc_lab.protocols.ArmDriver"]
    found = []
    if not driver.name or not driver.start_tolerance_rad > 0:
        found.append("it has no name, or a start tolerance that is not above 0")
    stamps, slowest, ahead_s = [], 0.0, 0.0
    for _ in range(_LOOKS):
        began = time.monotonic()
        status = driver.status()
        if not isinstance(status, ArmStatus):
            return [f"status() returned a {type(status).__name__}; it must be a torc_lab.protocols.ArmStatus"]
        now = time.monotonic()
        slowest, ahead_s = max(slowest, now - began), max(ahead_s, status.stamp_s - now)
        stamps.append(status.stamp_s)
        time.sleep(_APART_S)
    if ahead_s > 0:
        found.append(f"its states are {ahead_s:.1f} s in the future: stamp_s is by time.monotonic()")
    if slowest > AT_ONCE_S:
        found.append(f"status() waited {slowest:.2f} s; it must return what came last")
    if any(b < a for a, b in pairwise(stamps)) or len(set(stamps)) < 4:
        found.append("its stamps stand still, or run backwards")
    if np.ndim(status.qpos) != 1 or not np.isfinite(status.qpos).all():
        found.append("qpos must be one finite number per joint")
    if not driver.feels_contact and status.contact_n:
        found.append("it feels no contact, and reports one")
    if driver.ended() != "":
        found.append("ended() must be '' before the first motion")
    return found
