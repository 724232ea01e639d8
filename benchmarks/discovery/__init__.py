"""How well discovery names what it has never seen: a generator of hidden data, and its judge."""
