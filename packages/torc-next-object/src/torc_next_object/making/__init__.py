"""From problems to decisions: which looks, what each choice is worth, rows."""
