"""Runs all tests of the testee for commands with the C testee, whose answers must be the same."""

from __future__ import annotations

import pytest
from test_testee_commands import *  # noqa: F403

pytestmark = [pytest.mark.usefixtures("asks_both"), pytest.mark.matrix]
