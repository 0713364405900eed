"""The parts that come with torc-networks: a folder for each kind, a file for each part."""
