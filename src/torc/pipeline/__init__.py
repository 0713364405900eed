"""Turn one image into all that a task planner may see: scene, occlusion volume, grasps, validity, blocking."""
