# Generated from _devices/asynchronous/__init__.py by `python tools/unasync.py`; do not edit.

"""Devices for threads: their calls, their motions, and the classes that users hold."""
