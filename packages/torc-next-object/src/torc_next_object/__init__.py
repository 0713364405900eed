"""The data set torc-next-object: which object to remove first, with a value for every choice, and its scoring."""
