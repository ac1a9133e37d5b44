"""Commands in slots, setup commands of two bytes, and replies that are their data alone."""
