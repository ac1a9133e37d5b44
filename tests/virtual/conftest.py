"""Shared by the tests of virtual controllers."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from apt_host import Host, host_of


@pytest.fixture
def host() -> Callable[..., Host]:
    """``host("TDC001", seed=3)``: the other end of a new virtual unit of Thorlabs APT."""
    return host_of
