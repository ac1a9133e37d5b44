"""Links to controllers; public are the names of :mod:`stagewire.links`."""
