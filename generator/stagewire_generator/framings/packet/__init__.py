"""Packets: start bytes, a length, an id, a payload, and optionally an address, a check and end bytes."""
