"""Choose the next object to pick: relations between objects, the dependency graph, and the planners."""
