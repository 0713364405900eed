"""Draw one picture of one object as a trial draws: `python -m torc.sim.drawing_trial` prints how, or fails likewise.

It runs in its own process, since a failing GL library can take the process with it.
"""

import subprocess
import sys

from torc.errors import TorcError

_LIMIT_S = 120


def try_drawing() -> tuple[str, str]:
    """Return the backend that could draw a picture, and ""; or "" and why none could."""
    command = [sys.executable, "-P", "-m", "torc.sim.drawing_trial"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=_LIMIT_S)
    except subprocess.TimeoutExpired:
        return "", f"no picture within {_LIMIT_S} s"
    if done.returncode == 0:
        return done.stdout.split()[-1], ""  # libraries may print, too
    said = done.stderr.strip().splitlines()
    return "", said[-1] if said else f"the process ended with {done.returncode}"


def _draw() -> str:
    """Draw, and return the backend used. Raises RuntimeError if the object is not in its picture."""
    import numpy as np

    from torc.objects.library import load_object
    from torc.sim.gl import gl_backend
    from torc.sim.portraits import turn_table

    (picture,) = turn_table(load_object("mug_red"), sides=1)
    shown = picture[picture[..., 3] > 0, :3]
    if len(shown) == 0 or np.ptp(shown) < 10:
        raise RuntimeError("the picture is empty")
    return gl_backend()


if __name__ == "__main__":
    try:
        print(_draw())
    except TorcError as error:
        sys.exit(str(error))
