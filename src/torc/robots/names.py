"""Names of robots. Light to import, for the command line."""

DEFAULT_ROBOT = "sda10f_2f85"
"""The robot that comes with torc, and that the shipped problems are made for: the right arm of a Yaskawa SDA10F with a
Robotiq 2F-85."""
