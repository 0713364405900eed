"""Training of the grasp score: simulated trials of a floating gripper, gradient boosting, and a held-out report.

`python -m torc.grasping.training collect | train | evaluate | report`
"""
