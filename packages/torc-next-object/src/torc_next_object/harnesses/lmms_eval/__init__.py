"""Tasks of lmms-eval, as files: `torc next-object export --harness lmms-eval` writes them out with the data's place."""
