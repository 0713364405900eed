"""Configurations that the tests share."""

from torc.generation.config import GenerationConfig

SMALL = GenerationConfig("structured", objects=(8, 8))
