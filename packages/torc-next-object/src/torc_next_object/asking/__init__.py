"""`torc vlm-eval`: a model is asked about every decision; what came of it."""
