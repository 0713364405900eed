"""Many trials: their plan (spec), their players (runner, local pool), their directory (store), and the report."""
