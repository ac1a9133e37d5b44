"""Controller discovery; the public names are in :mod:`stagewire.discovery`."""
