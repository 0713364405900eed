"""TORC: targeted object retrieval in clutter.

A robot arm with a parallel gripper and one RGB-D camera finds and retrieves a target, often hidden, from
unknown objects without 3-D models, one pick after another. The packages, in the order in which imports
may point (only to earlier ones):

records, geometry, scenes, robots, sim, perception, occlusion, collision, grasping, motion, pipeline,
task_planning, episode, cli; `testing` holds fakes and conformance suites.
"""

__version__ = "0.1.0"
