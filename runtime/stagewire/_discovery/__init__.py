"""Controller discovery; public are the names of :mod:`stagewire.discovery`."""
