"""Generate the synchronous half of the library from its asyncio half.

``python tools/unasync.py`` writes the modules. ``--check`` writes nothing, lists the modules that differ and
exits with status 1 if there are any. Each module of the asyncio half is copied with the substitutions in
``PASSAGES``, for real differences such as a parameter that only threads need, and those in ``WORDS``. Ruff
formats the copy. A passage that does not occur is an error, so that outdated entries are removed.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
PACKAGE: Final = ROOT / "runtime" / "stagewire"
COMMAND: Final = "python tools/unasync.py"

MODULES: Final = {
    "_sessions/asynchronous.py": "_sessions/synchronous.py",
    "_devices/asynchronous": "_devices/synchronous",
}
"""Modules or folders of the asyncio half -> their copies."""

WORDS: Final = (
    (r"\basync (?=def |with |for )", ""),
    (r"\bawait ", ""),
    (r"\b__aenter__\b", "__enter__"),
    (r"\b__aexit__\b", "__exit__"),
    (r"\bopen_async_link\b", "open_link"),
    (r"\bOpening\[D\]", "D"),
    (r"\basynchronous(?=[ .`_])", "synchronous"),
    (r"\bAsync(Locks|Link|Closing|Iterator|FramedSession|CommandSession|Session|Worker)\b", r"\1"),
    (r"\bAsyncSubscription\b", "BlockingSubscription"),
    (r"\basynccontextmanager\b", "contextmanager"),
    (r"\basync_clock_of\b", "clock_of"),
    (r"\b_sessions\.awaiting\b", "_sessions.calling"),
    (r"\bloop_driver\b", "thread_driver"),
    (r"\bfor asyncio\b", "for threads"),
    (r"\bhow tasks share\b", "how threads share"),
    (r", as awaitable calls\b", ", as plain calls"),
    (r"\bopen and not started; the session owns\b", "open; the session owns"),
)
"""Regular expressions and their replacements, in order."""

_BACKGROUND: Final = (
    (
        "        log: str | Path | None",
        "        background: bool = True,\n        log: str | Path | None",
    ),
    ("(core, link, recording", "(core, link, background=background, recording"),
    (
        "    :param options: timeouts and pauses.\n",
        "    :param options: timeouts and pauses.\n"
        "    :param background: whether a background thread reads and sends keep-alive messages; never for\n"
        "        a link with its own clock.\n",
    ),
)

PASSAGES: Final[dict[str, tuple[tuple[str, str], ...]]] = {
    "_sessions/asynchronous.py": _BACKGROUND,
    "_devices/asynchronous/devices.py": (
        (
            " Each device belongs to one event loop.\n\n"
            ":mod:`stagewire._devices.synchronous.devices` contains the same classes for threads.\n",
            " Any thread may make any call.\n",
        ),
        ("from stagewire._devices.opening import Opening\n", ""),
        ("        return Opening(device)\n", "        device._connect()\n        return device\n"),
        (
            "the controller on it, to await or to enter. Nothing moves.\n\n        The output of a laser or "
            "heater is switched off, unless ``on_close`` is ``leave``.\n\n"
            "        ``async with TDC001.open(url) as tdc:`` closes it at the end. After ``tdc = await "
            "TDC001.open(url)``,\n        call :meth:`close`.\n",
            "the controller on it. Nothing moves.\n\n        The output of a laser or heater is switched "
            "off, unless ``on_close`` is ``leave``.\n",
        ),
    ),
    "_devices/asynchronous/transport.py": (
        (
            "            options=options,\n",
            "            options=options,\n            background=connection.choices.background,\n",
        ),
    ),
}
"""Module -> passages of its text and their replacements, applied before ``WORDS``."""


def pairs() -> Iterator[tuple[Path, Path]]:
    """Yield each module of the asyncio half with its copy."""
    for source, copy in MODULES.items():
        if source.endswith(".py"):
            yield PACKAGE / source, PACKAGE / copy
        else:
            for module in sorted((PACKAGE / source).glob("*.py")):
                yield module, PACKAGE / copy / module.name


def generated(source: Path) -> str:
    """Return the synchronous copy of a module.

    Raises :class:`ValueError` if a passage does not occur in its text.
    """
    name = source.relative_to(PACKAGE).as_posix()
    text = source.read_text(encoding="utf-8")
    for passage, replacement in PASSAGES.get(name, ()):
        if passage not in text:
            raise ValueError(
                f"{name} does not contain {passage!r}; correct PASSAGES in tools/unasync.py"
            )
        text = text.replace(passage, replacement)
    for pattern, replacement in WORDS:
        text = re.sub(pattern, replacement, text)
    text = f"# Generated from {name} by `{COMMAND}`; do not edit.\n\n{text}"
    for step in (("check", "--quiet", "--fix-only", "--select", "I"), ("format", "--quiet")):
        text = _ruff(text, *step, "--stdin-filename", str(source.with_name("copy.py")), "-")
    return text


def _ruff(text: str, *arguments: str) -> str:
    command = [sys.executable, "-m", "ruff", *arguments]
    done = subprocess.run(command, input=text, capture_output=True, encoding="utf-8", check=True)
    return done.stdout


def drift() -> dict[Path, str | None]:
    """Return the outdated copies with their new text, or None for a copy without a source."""
    expected = {copy: generated(source) for source, copy in pairs()}
    found: dict[Path, str | None] = {
        copy: text
        for copy, text in expected.items()
        if not copy.exists() or copy.read_text(encoding="utf-8") != text
    }
    folders = [PACKAGE / copy for copy in MODULES.values() if not copy.endswith(".py")]
    left = {module for folder in folders for module in folder.glob("*.py")} - set(expected)
    return {**found, **dict.fromkeys(left)}


def main() -> int:
    """Write or check the copies; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--check", action="store_true", help="write nothing; exit with status 1 if a copy differs"
    )
    check = parser.parse_args().check
    different = drift()
    for copy, text in different.items():
        print(f"{copy.relative_to(ROOT)} {'differs' if check else 'written'}")
        if check:
            continue
        if text is None:
            copy.unlink()
        else:
            copy.parent.mkdir(exist_ok=True)
            copy.write_text(text, encoding="utf-8")
    return 1 if check and different else 0


if __name__ == "__main__":
    sys.exit(main())
