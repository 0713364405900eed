"""The parts that come with torc-lab: a folder for each kind, a file for each part."""
