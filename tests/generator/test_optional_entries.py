"""A spec without an entry either has a diagnostic, or is still rendered by all targets."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import plain_yaml
from parts import every_nth
from stagewire_generator import TARGETS, check, render
from stagewire_generator.diagnostics import SpecError

pytestmark = pytest.mark.usefixtures("quick_checking")

# Keys of each file that may be left out.
OPTIONAL = {
    "protocol": "name_prefix note",
    "quantities": "printed settings source",
    "stages": "note printed servo_cycle_us",
    "units": "completes keep_alive known_prefixes pause update_rate_hz usb_prefix",
    "messages/core": (
        "addressee call completes_with flags_by_unit halted_by more_pages motion note "
        "pages param1 stored target tells"
    ),
    "errata/core": "fields",
    "printed/core": "columns default last_offset packet ranges structure values",
}
OPTIONAL_OF_COMMANDS = {
    "protocol": "erratum_prefix",
    "quantities": "printed source",
    "units": "baud_rates note source",
    "messages/setup": "firmware",
    "messages/walk": "call default ends_when exchange halted_by minimum stored",
    "errata/walk": "fields",
    "printed/commands": "bits breakdowns bytes means no_data reads returns size_optional spaces",
    "printed/format": "commands",
    "printed/setup": "keyboard post_byte",
}


def keys(data: Any) -> Iterator[str]:
    """Yield the key of every mapping."""
    if isinstance(data, dict):
        yield from data
    for value in data.values() if isinstance(data, dict) else data:
        if isinstance(value, dict | list):
            yield from keys(value)


def without(data: Any, key: str) -> Any:
    """Return the data with every occurrence of a key removed."""
    if isinstance(data, dict):
        return {k: without(v, key) for k, v in data.items() if k != key}
    return [without(item, key) for item in data] if isinstance(data, list) else data


def made(spec: Path) -> bool:
    """Whether all targets can be rendered; otherwise the spec must have diagnostics."""
    try:
        protocols = check(spec)
    except SpecError:
        return False
    return bool(render(protocols, TARGETS))


def missed(spec: Path, name: str) -> set[str]:
    """Return the keys of a file that may be left out."""
    path = spec / f"{name}.yaml"
    data = plain_yaml.load(path.read_text(encoding="utf-8"))
    fine = set()
    for key in sorted(set(keys(data))):
        path.write_text(json.dumps(without(data, key)), encoding="utf-8")
        if made(spec):
            fine.add(key)
    return fine


@pytest.mark.parametrize("name", every_nth(OPTIONAL, 2))
def test_any_key_may_be_missing(spec: Path, name: str) -> None:
    assert missed(spec, f"tiny/{name}") >= set(OPTIONAL[name].split())


@pytest.mark.parametrize("name", every_nth(OPTIONAL_OF_COMMANDS, 2))
def test_any_key_of_a_spec_of_commands_may_be_missing(commands_spec: Path, name: str) -> None:
    wanted = set(OPTIONAL_OF_COMMANDS[name].split())
    assert missed(commands_spec, f"turtle/{name}") >= wanted
