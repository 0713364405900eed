"""Transforms and projection."""
