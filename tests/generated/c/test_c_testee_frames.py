"""All tests of the testee on frames once more: what they ask, the one in C answers, too, and alike."""

from __future__ import annotations

import pytest
from test_testee import *  # noqa: F403

pytestmark = [pytest.mark.usefixtures("asks_both"), pytest.mark.matrix]
