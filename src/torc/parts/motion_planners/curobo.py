"""Free motions by cuRobo, from a server."""

from torc.motion.network.planner import CuroboMotionPlanner as PART
