"""What units must say, written by hand from the documents and not from registry or code (``exchanges/``).

A step is what the host sends (``host``), or what the controller says: at once, ``after`` so many seconds, or
``within`` them; ``every`` so many seconds, ``times`` over; or nothing, for so many seconds (``silent``).
Seconds count from the last thing that the host sent; an instant is right within a millisecond. Whatever the
controller says must stand there. In the hexadecimal bytes a dot is a digit that the document leaves open,
and ``..*4`` are four such bytes.
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
"""How often the controller is looked at while something may come within a time."""


class Conversation:
    """A host that holds a controller and knows what it has not yet been told to expect."""

    def __init__(self, controller: virtual.VirtualController) -> None:
        self.controller = controller
        self.heard = b""
        self.spoke = 0.0

    @property
    def now(self) -> float:
        """Seconds since the controller was made."""
        return self.controller.clock.now / SECOND

    def wait_until(self, when: float) -> None:
        """Let time go on."""
        self.controller.advance(max(0.0, when - self.now))
        self.heard += self.controller.read()

    def nothing(self) -> None:
        """Nothing was said that no step has."""
        assert self.heard == b"", f"unexpected at {self.now} s: {self.heard.hex(' ')}"

    def host(self, text: str) -> None:
        """Send."""
        self.nothing()
        self.controller.write(bytes.fromhex(text))
        self.spoke = self.now
        self.wait_until(self.now)

    def said(self, expected: str) -> None:
        """These bytes are the next."""
        pattern, size = compiled(expected)
        found = self.heard[:size].hex()
        assert pattern.fullmatch(found), f"{self.heard.hex(' ')} is not {expected}"
        self.heard = self.heard[size:]

    def at(self, after: float, expected: str) -> None:
        """These bytes are said at an instant, and nothing before."""
        self.wait_until(self.spoke + after - TOLERANCE)
        self.nothing()
        self.wait_until(self.spoke + after + TOLERANCE)
        self.said(expected)

    def within(self, longest: float, expected: str) -> None:
        """These bytes are said after a time, and nothing before."""
        while not self.heard and self.now < self.spoke + longest:
            self.wait_until(self.now + LOOK)
        self.said(expected)

    def step(self, step: dict[str, Any]) -> None:
        """Take one step of an exchange."""
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
        assert not rest, f"not understood in a step: {rest}"


def compiled(expected: str) -> tuple[re.Pattern[str], int]:
    """Return a pattern of hexadecimal digits, and how many bytes it has."""
    digits = ""
    for token in expected.lower().split():
        byte, _, times = token.partition("*")
        assert re.fullmatch(r"[0-9a-f.]{2}", byte), f"no byte: {token}"
        digits += byte * int(times or 1)
    return re.compile(digits), len(digits) // 2


def options(given: dict[str, Any]) -> dict[str, Any]:
    """Return the options of a file or an exchange as keywords."""
    found = dict(given)
    if "stage" in found:
        found["stage"] = getattr(stagewire_apt.stages, found["stage"])
    if "empty_bays" in found:
        found["empty_bays"] = frozenset(found["empty_bays"])
    return found


@pytest.mark.parametrize(("name", "exchange"), EXCHANGES)
def test_exchange(name: str, exchange: dict[str, Any]) -> None:
    file = FILES[name]
    keywords = options({**file.get("options", {}), **exchange.get("options", {})})
    with getattr(virtual, file["unit"])(**keywords) as controller:
        conversation = Conversation(controller)
        for step in exchange["steps"]:
            conversation.step(step)
        conversation.nothing()


def test_ten_units_of_different_families() -> None:
    families = {find_unit(file["unit"]).facts["family"] for file in FILES.values()}
    assert len(FILES) >= 10
    assert len(families) >= 10
