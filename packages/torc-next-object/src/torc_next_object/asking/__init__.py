"""`torc vlm-eval`: ask a model about every decision, and score its replies."""
