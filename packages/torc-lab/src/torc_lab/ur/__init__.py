"""Arms of Universal Robots, by ur_rtde."""
