# Generated from _devices/asynchronous/__init__.py by `python tools/unasync.py`; do not edit.

"""Devices for threads: calls, motions, and the base classes of generated devices."""
