"""Problems: which objects lie where, and which one is the target; the shipped sets."""
