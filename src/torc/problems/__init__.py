"""Problems: which objects lie where, and which one is wanted; the shipped sets."""
