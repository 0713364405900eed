"""Check what every gripper driver must do, best on a twin: `check_gripper_driver(lambda: MyDriver(...))`."""

import math
from collections.abc import Callable, Iterator

from torc import TorcError
from torc.registry.kinds import GRIPPER_DRIVERS
from torc.testing.conformance import require, trait_faults
from torc_lab.protocols import GripperDriver, LabError, NeedsActivation, missing_methods

_NEAR_M = 0.005
"""How far from the wanted opening the pads may come to rest."""
_FORCE_N = 20.0


def check_gripper_driver(connect: Callable[[], GripperDriver]) -> None:
    """Open the gripper, close it on nothing, open it halfway, and end the connection. **The fingers move.**

    Nothing may be between them. A gripper that needs activation is activated.

    Args:
        connect: makes a connection.

    Raises:
        NonConformanceError: names everything that is broken.
        LabError: the device does not answer.
    """
    driver = connect()
    if missing := missing_methods(driver, GripperDriver):
        require("gripper driver", [f"it lacks {', '.join(missing)} of torc_lab.protocols.GripperDriver"])
    try:
        if isinstance(driver, NeedsActivation) and not driver.ready:
            driver.activate()
        found = [*trait_faults(GRIPPER_DRIVERS, driver), *_moves(driver)]
    finally:
        driver.disconnect()
    try:
        driver.open(driver.max_width_m)
        found.append("open() must raise LabError once the connection has ended")
    except LabError:
        pass
    except TorcError as error:
        found.append(f"open() raises {type(error).__name__}, not LabError, once the connection has ended")
    require("gripper driver", found)


def _moves(driver: GripperDriver) -> Iterator[str]:
    largest_m = driver.max_width_m
    if not (math.isfinite(largest_m) and 0.005 < largest_m < 1.0):
        yield f"max_width_m is {largest_m!r}; it is the largest opening between the pads, in metres"
        return
    for wanted_m in (largest_m, largest_m / 2):
        opened = driver.open(wanted_m)
        if not abs(opened.width_m - wanted_m) < _NEAR_M:
            yield f"open({wanted_m:.3f}) returned with the pads {opened.width_m:.3f} m apart"
        if opened.holding or driver.state.holding:
            yield f"it holds something after open({wanted_m:.3f})"
        if not abs(driver.state.width_m - opened.width_m) < _NEAR_M:
            yield f"the pads still move after open({wanted_m:.3f}) has returned"
        closed = driver.close(_FORCE_N)
        if closed.holding or not closed.width_m < _NEAR_M:
            yield f"close() on nothing reports {closed.width_m:.3f} m and holding={closed.holding}"
    driver.open(largest_m)
