"""Packets: start bytes, a length, an id, a payload, and perhaps an address, a check and end bytes."""
