"""Specifications of trials: plain frozen data, from which everything else is made."""
