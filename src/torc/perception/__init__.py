"""From a snapshot to a segmented scene, and the marked image that people and VLMs look at."""
