"""Make decisions from problems: which looks, the value of each choice, rows."""
