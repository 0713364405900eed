"""Turn a snapshot into a segmented scene, and into the marked image that people and VLMs look at."""
