"""torc's own parts behind the server that networks have: `torc serve`."""
