"""Making, checking and describing retrieval problems."""
