"""The report on a benchmark: one HTML page, one Markdown page, figures and tables."""
