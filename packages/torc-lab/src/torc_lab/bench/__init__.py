"""Comparing task planners on a real robot: scenes that a person lays out again and again."""
