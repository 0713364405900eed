"""Free motions by cuRobo, from a server."""

from torc_networks.motion.planner import CuroboMotionPlanner as PART
