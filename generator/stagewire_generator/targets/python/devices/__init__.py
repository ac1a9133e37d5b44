"""Device classes: what a unit is asked and told, as methods, for threads and for asyncio."""

from stagewire_generator.targets.python.devices.view import DevicesView, devices_view

__all__ = ["DevicesView", "devices_view"]
