"""Puts this folder on the import path: what several rooms of the tests share stands here."""

pytest_plugins = ["stagewire_virtual.pytest_plugin", "systems"]
