"""Stages before the grasps whose network runs in another process: depth from two pictures, and masks."""
