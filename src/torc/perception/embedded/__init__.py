"""Eyes that come with torc: objects on a support from colour and depth, by a small network on the processor."""
