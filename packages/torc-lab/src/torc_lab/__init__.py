"""Run torc on real robots: drivers, and the supervisor between them and torc's loop."""
