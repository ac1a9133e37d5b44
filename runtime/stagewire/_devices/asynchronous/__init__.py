"""Devices for asyncio: calls, motions, and the base classes of generated devices."""
