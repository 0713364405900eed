"""Families of harder problems; `torc problems generate --family`."""
