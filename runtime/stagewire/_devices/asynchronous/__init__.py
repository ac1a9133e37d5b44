"""Devices for asyncio: their calls, their motions, and the classes that users hold."""
