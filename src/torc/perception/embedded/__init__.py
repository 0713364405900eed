"""torc's own perception: finds objects on a support from colour and depth, by a small network on the processor."""
