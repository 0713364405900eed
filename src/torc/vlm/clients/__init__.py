"""The vendors, one module each, the only one that imports its library; and what they share: retries and scrubbing."""
