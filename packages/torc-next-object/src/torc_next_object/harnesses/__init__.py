"""The set in other people's evaluation harnesses."""
