"""How likely a grasp must be to hold to count while there are better ones. Light to import, for the command line."""

DEFAULT_MIN_SCORE = 0.25
"""At .25 three of four tries fail, and leave the object further away or lying down."""
