"""Robots: descriptions read from files, kinematics, the protocols of hardware, and the execution of a pick."""
