"""Captures as columns. The public names are in :mod:`stagewire.columns`."""
