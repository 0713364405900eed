"""Which object to pick next: relations between objects, the dependency graph, and the planners."""
