"""Files that anybody may have written: read strictly, their faults in words."""
