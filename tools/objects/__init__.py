"""Draws the objects that come with torc. Run as `python -m tools.objects`; torc itself only reads what it writes."""
