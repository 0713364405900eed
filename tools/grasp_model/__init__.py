"""Training of the grasp score: simulated trials of a floating gripper, gradient boosting, and a held-out report.

`python -m tools.grasp_model collect | train | evaluate | report`
"""
