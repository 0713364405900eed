"""The occlusion volume: what has never been seen, and which object hides it."""
