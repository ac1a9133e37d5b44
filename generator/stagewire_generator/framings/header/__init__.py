"""Frames with a header: an id, two parameters or the length of a packet, and two addresses."""
