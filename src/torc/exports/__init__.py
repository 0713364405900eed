"""Recorded trials as data for other people's programs: fine-tuning examples, preference pairs, robot trajectories."""
