"""The set on disk: Parquet files, their card, and whether they may be published."""
