"""Scenes that a person lays out again and again: their reference, and how far the table is like it now."""
