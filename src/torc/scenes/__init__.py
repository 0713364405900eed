"""The world of a task: the workspace, the object library, problems and arrangements."""
