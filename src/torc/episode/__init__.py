"""The loop of look, decide, plan, execute; its events, and what becomes of them: log, pictures, video."""
