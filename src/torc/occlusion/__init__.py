"""The occlusion volume: which space was never seen, and which object hides it."""
