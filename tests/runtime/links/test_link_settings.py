"""Options of links: accepted values, and the errors for invalid ones."""

from __future__ import annotations

import asyncio
import dataclasses

import pytest

from stagewire.errors import BadValueError, OutOfRangeError, StagewireError
from stagewire.links import LinkSettings, open_async_link, open_link


def test_the_defaults_are_those_of_the_document() -> None:
    settings = LinkSettings()
    assert (settings.baudrate, settings.purge_dwell) == (115200, 0.05)
    assert settings.rtscts is None
    with pytest.raises(dataclasses.FrozenInstanceError):
        settings.baudrate = 9600  # type: ignore[misc]


@pytest.mark.parametrize(
    ("options", "kind", "says"),
    [
        ({"baudrate": "9600"}, BadValueError, "whole number of bits per second, not '9600'"),
        ({"baudrate": True}, BadValueError, "not True"),
        ({"baudrate": 0}, OutOfRangeError, "baudrate 0 is outside 50 to 12000000"),
        ({"rtscts": 1}, BadValueError, "rtscts must be True, False or None"),
        ({"purge": "yes"}, BadValueError, "purge must be True, False or None"),
        ({"purge_dwell": -0.1}, OutOfRangeError, "outside 0 to 10 seconds"),
        ({"purge_dwell": "1"}, BadValueError, "purge_dwell must be a number of seconds, not '1'"),
        (
            {"open_timeout": 0},
            OutOfRangeError,
            "open_timeout must be over 0 and at most 3600 seconds, not 0",
        ),
        ({"open_timeout": float("nan")}, BadValueError, "must be a number of seconds, not nan"),
        ({"stall_timeout": float("inf")}, OutOfRangeError, "at most 3600 seconds"),
        ({"baud": 9600}, BadValueError, "unknown link option: baud (known: baudrate, rtscts,"),
    ],
)
def test_invalid_options(options: dict[str, object], kind: type[StagewireError], says: str) -> None:
    with pytest.raises(kind) as refused:
        open_link("loop://", **options)
    assert says in str(refused.value)
    with pytest.raises(kind) as refused:
        asyncio.run(open_async_link("loop://", **options))
    assert says in str(refused.value)
