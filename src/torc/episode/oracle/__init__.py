"""ORACLE: the order of picks that needs the fewest, found by trying them out."""
