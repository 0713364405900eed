"""Real robots: drivers, and the supervisor between them and torc's loop."""
