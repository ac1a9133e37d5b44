"""Links to controllers. The public names are in :mod:`stagewire.links`."""
