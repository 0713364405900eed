"""The eyes that come with torc: scenes to learn from, training, export, measures.

`python -m tools.eyes collect | train | describe | export | measure | target`; needs torch and onnx beside torc.
"""
