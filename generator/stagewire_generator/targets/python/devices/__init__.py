"""Device classes, for threads and for asyncio: a method for each request to a unit."""

from stagewire_generator.targets.python.devices.view import DevicesView, devices_view

__all__ = ["DevicesView", "devices_view"]
