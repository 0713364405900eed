"""The local page: an expert as task planner (`torc human`), and the viewer of recorded trials (`torc view`)."""
