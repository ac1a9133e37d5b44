"""The generated C under test, with its tests: generated again if an input has changed."""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
from pathlib import Path

import jinja2

from stagewire_generator import check, render
from stagewire_generator.pipeline import inputs
from stagewire_generator.reader import find_spec

ROOT = Path(__file__).parents[3]
TARGETS = ("c", "c-tests", "vectors")
_BUILD = ROOT / "build"


def generated() -> Path:
    """Return the folder of all packages; ``STAGEWIRE_C`` can name a folder of your own.

    All processes of a test run share it: the first one generates it, the others wait.
    """
    if elsewhere := os.environ.get("STAGEWIRE_C"):
        return Path(elsewhere)
    out, key = _BUILD / "generated", _BUILD / "generated.key"
    _BUILD.mkdir(exist_ok=True)
    with open(_BUILD / "generated.lock", "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        now = _digest(inputs([find_spec(ROOT / "spec")]), f"{TARGETS} {jinja2.__version__}")
        if not key.exists() or key.read_text(encoding="ascii") != now:
            key.unlink(missing_ok=True)
            shutil.rmtree(out, ignore_errors=True)
            for path, text in render(check(ROOT / "spec"), TARGETS).items():
                (out / path).parent.mkdir(parents=True, exist_ok=True)
                (out / path).write_text(text, encoding="utf-8")
            key.write_text(now, encoding="ascii")
    return out / "c"


def _digest(paths: list[Path], settings: str) -> str:
    """Return a digest of settings, and of the paths and contents of files."""
    digest = hashlib.sha256(settings.encode())
    for path in paths:
        digest.update(f"{path}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()
