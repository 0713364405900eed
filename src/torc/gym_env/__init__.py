"""`torc/Retrieval-v0`: a Gymnasium environment over "which object next".

Importing this package registers the name with Gymnasium, which has no entry points for that since its version 1.0; so
does `gymnasium.make("torc.gym_env:torc/Retrieval-v0")`. The simulation is imported when an environment is made.
"""

from torc.errors import MissingDependencyError, extra_remedy

try:
    from gymnasium.envs.registration import register
except ImportError as error:
    raise MissingDependencyError("Gymnasium", extra_remedy("gym")) from error

ENVIRONMENT = "torc/Retrieval-v0"

register(id=ENVIRONMENT, entry_point="torc.gym_env.env:RetrievalEnv")
