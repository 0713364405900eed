"""The parts that come with torc: a folder for each kind, a file for each part. They are found by their names alone."""
