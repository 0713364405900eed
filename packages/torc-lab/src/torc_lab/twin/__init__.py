"""Twins of a laboratory's devices: a simulated robot that speaks a real one's protocols, to rehearse on."""
