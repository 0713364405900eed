"""Run the loop of look, decide, plan, execute; record its events as log, pictures and video."""
