"""Segmentation networks of others as perceptions: Grounding DINO with SAM 2.1 (the paper's), SAM 3, SAM 2.1 as ONNX."""
