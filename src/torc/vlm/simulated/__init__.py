"""The simulated VLM: answers in a model's format from the simulator's truth, with a stated error rate."""
