"""Recorded trials as data for other programs: fine-tuning examples, preference pairs, robot trajectories."""
