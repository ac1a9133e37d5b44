"""Fixtures for the tests of virtual controllers."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from apt_host import Host, host_of


@pytest.fixture
def host() -> Callable[..., Host]:
    """Return a factory of hosts: ``host("TDC001", seed=3)`` is the host of a new virtual APT unit."""
    return host_of
