"""Cameras: each is a part of the stage `camera` and is opened when its first picture is requested.

Only the module that drives a camera imports its library.
"""
