"""Many trials: what is played (spec), by whom (runner, local pool), where it lies (store), what it says (report)."""
