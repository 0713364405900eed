"""Many trials: what is played (spec), by whom (runner, local pool), where it is kept (store), and the report."""
