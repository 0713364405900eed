"""The simulated VLM: answers in a model's format from the simulator's truth, confused to a stated degree."""
