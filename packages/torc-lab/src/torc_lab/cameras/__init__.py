"""Cameras: each is a part of the stage `camera`, opened when its first picture is asked for.

A camera's library is imported only by the module that speaks to it.
"""
