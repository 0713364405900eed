"""torc's own parts behind the server that networks have: `torc serve`. Each handler is made at its first request."""
