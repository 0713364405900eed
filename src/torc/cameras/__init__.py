"""The camera that plays recorded frames; device cameras come with torc-lab."""
