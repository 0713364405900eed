"""Exchangeable parts: their kinds, how they are found by name, and how they are made."""
