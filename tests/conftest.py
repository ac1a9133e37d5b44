"""Settings for all tests. Modules shared by several folders are in ``support/``."""

from __future__ import annotations

import gc
import logging
from collections.abc import Generator

import pytest
from hypothesis import settings

# A slow example on a busy machine is not a failure.
settings.register_profile("stagewire", deadline=None)
settings.load_profile("stagewire")

pytest_plugins = ["stagewire_virtual.pytest_plugin", "systems"]


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect tests without garbage collection, since nearly all new objects stay until the end.

    Importing pymmcore-plus lowers the level of the root logger, so that the debug messages of every package
    are recorded: the level is restored.
    """
    root = logging.getLogger()
    level = root.level
    gc.disable()
    result = yield
    gc.freeze()
    gc.enable()
    root.setLevel(level)
    return result
