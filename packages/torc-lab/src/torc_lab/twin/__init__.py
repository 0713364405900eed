"""The laboratory's twin: a simulated robot behind the wires of a real one, to rehearse on. Nothing here is real."""
