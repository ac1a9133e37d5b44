"""Devices for asyncio. ``tools/unasync.py`` generates the devices for threads from them."""
