"""Exchanges written by hand from the documents, independently of the registry and the code (``exchanges/``).

A step has bytes of the host (``host``) or of the controller. The latter arrive immediately, ``after`` a
number of seconds, ``within`` that time, or ``every`` so many seconds and ``times`` times; ``silent`` expects
no bytes for a number of seconds. Seconds count from the last bytes of the host, with a tolerance of a
millisecond. Steps must account for every byte of the controller. In the hexadecimal bytes a dot is any digit,
and ``..*4`` is any four bytes.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import plain_yaml
import stagewire_apt
import stagewire_virtual as virtual
from stagewire_virtual.clock import SECOND
from stagewire_virtual.instrument import find_unit

FOLDER = Path(__file__).parent / "exchanges"
FILES: dict[str, Any] = {path.stem: plain_yaml.read(path) for path in sorted(FOLDER.glob("*.yaml"))}
EXCHANGES = [
    pytest.param(name, exchange, id=f"{name}: {exchange['exchange']}")
    for name, file in FILES.items()
    for exchange in file["exchanges"]
]
TOLERANCE = 0.001
LOOK = 0.01
"""The interval at which the controller is checked for bytes that may arrive within a time."""


class Conversation:
    """The host of a controller, with the received bytes that no step has matched yet."""

    def __init__(self, controller: virtual.VirtualController) -> None:
        self.controller = controller
        self.heard = b""
        self.spoke = 0.0

    @property
    def now(self) -> float:
        """The seconds since the controller was created."""
        return self.controller.clock.now / SECOND

    def wait_until(self, when: float) -> None:
        """Advance the clock to a time."""
        self.controller.advance(max(0.0, when - self.now))
        self.heard += self.controller.read()

    def nothing(self) -> None:
        """Check that no unmatched bytes were received."""
        assert self.heard == b"", f"unexpected at {self.now} s: {self.heard.hex(' ')}"

    def host(self, text: str) -> None:
        """Send."""
        self.nothing()
        self.controller.write(bytes.fromhex(text))
        self.spoke = self.now
        self.wait_until(self.now)

    def said(self, expected: str) -> None:
        """Check that the next bytes match."""
        pattern, size = compiled(expected)
        found = self.heard[:size].hex()
        assert pattern.fullmatch(found), f"{self.heard.hex(' ')} is not {expected}"
        self.heard = self.heard[size:]

    def at(self, after: float, expected: str) -> None:
        """Check that bytes arrive at an instant, and none before."""
        self.wait_until(self.spoke + after - TOLERANCE)
        self.nothing()
        self.wait_until(self.spoke + after + TOLERANCE)
        self.said(expected)

    def within(self, longest: float, expected: str) -> None:
        """Check that bytes arrive within a time, and none before."""
        while not self.heard and self.now < self.spoke + longest:
            self.wait_until(self.now + LOOK)
        self.said(expected)

    def step(self, step: dict[str, Any]) -> None:
        """Carry out one step of an exchange."""
        match step:
            case {"host": str(text), **rest}:
                self.host(text)
            case {"silent": seconds, **rest}:
                self.wait_until(self.now + seconds)
                self.nothing()
            case {"power_cycle": True, **rest}:
                self.nothing()
                self.controller.power_cycle()
            case {"every": period, "times": times, "controller": str(text), **rest}:
                for count in range(1, times + 1):
                    self.at(count * period, text)
            case {"after": seconds, "controller": str(text), **rest}:
                self.at(seconds, text)
            case {"within": seconds, "controller": str(text), **rest}:
                self.within(seconds, text)
            case {"controller": str(text), **rest}:
                self.said(text)
            case rest:
                pass
        assert not rest, f"unknown keys in a step: {rest}"


def compiled(expected: str) -> tuple[re.Pattern[str], int]:
    """Return a pattern of hexadecimal digits, and its number of bytes."""
    digits = ""
    for token in expected.lower().split():
        byte, _, times = token.partition("*")
        assert re.fullmatch(r"[0-9a-f.]{2}", byte), f"not a byte: {token}"
        digits += byte * int(times or 1)
    return re.compile(digits), len(digits) // 2


def options(given: dict[str, Any]) -> dict[str, Any]:
    """Return the options of a file or an exchange as keyword arguments."""
    found = dict(given)
    if "stage" in found:
        found["stage"] = getattr(stagewire_apt.stages, found["stage"])
    if "empty_bays" in found:
        found["empty_bays"] = frozenset(found["empty_bays"])
    return found


@pytest.mark.parametrize(("name", "exchange"), EXCHANGES)
def test_an_exchange_matches_the_document(name: str, exchange: dict[str, Any]) -> None:
    file = FILES[name]
    keywords = options({**file.get("options", {}), **exchange.get("options", {})})
    with getattr(virtual, file["unit"])(**keywords) as controller:
        conversation = Conversation(controller)
        for step in exchange["steps"]:
            conversation.step(step)
        conversation.nothing()


def test_exchanges_exist_for_many_families() -> None:
    families = {find_unit(file["unit"]).facts["family"] for file in FILES.values()}
    assert len(FILES) >= 10
    assert len(families) >= 10
