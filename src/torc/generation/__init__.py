"""Make, check and describe retrieval problems."""
