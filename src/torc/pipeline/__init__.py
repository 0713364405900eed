"""From one image to all that a task planner may see: perceive, occlusion volume, grasps, validity, blocking."""
