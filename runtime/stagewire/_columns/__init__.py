"""Captures as columns; public are the names of :mod:`stagewire.columns`."""
