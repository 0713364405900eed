"""Scenes of GraspClutter6D as problems: settled in simulation, with a target.

The retrieval paper's authors put each scene on a table in MuJoCo, labelled it structured or unstructured by hand, chose
targets by hand, and adjusted what did not work (section "Simulated Dataset"). Here rules do the same, and failures are
reported.
"""
