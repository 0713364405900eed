"""The commands `torc lab`, `torc retrieve` and `torc camera`."""
