"""Commands as they are typed, for those who are to repeat one."""

from __future__ import annotations

import os
import shlex
import subprocess
from collections.abc import Sequence

__all__ = ["as_typed"]


def as_typed(words: Sequence[str]) -> str:
    """Return words as they are typed at a prompt of this system."""
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)
