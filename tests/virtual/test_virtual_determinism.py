"""The same seed produces the same bytes in every process, whatever the hash seed of its sets."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from stagewire_virtual.factory import simulated_units

# Prints the answers of every unit to random messages: plain, then with all quirks and random faults.
PROGRAM = """
import hashlib
from random import Random
import stagewire_virtual as virtual
from stagewire_virtual.thorlabs_apt.quirks import QUIRKS
from stagewire_virtual.factory import simulated_units

FAULTS = ["to_host drop p=0.1", "to_host flip byte p=0.01", "to_host delay p=0.2 by=0.3",
          "to_controller insert byte p=0.01", "to_host duplicate p=0.1"]
COMMANDS = [b"W X\\r", b"\\xff\\x42", b"\\x18a\\x03:", b"\\x18G:", b"\\x18?:", b"\\x18T\\x03abc:"]
for name, unit in sorted(simulated_units().items()):
    apt = unit.protocol.name == "thorlabs_apt"
    for faults in [], FAULTS:
        rng = Random(name)
        options = {"quirks": set(QUIRKS), "answer_unsupported": True} if apt and faults else {}
        controller = getattr(virtual, name)(seed=SEED, faults=faults, **options)
        ids = sorted(unit.message(each)["id"] for each in unit.messages if apt)
        said = b""
        for _ in range(60):
            header = bytes((1, 1, rng.choice((0x50, 0x11, 0x21)), 1))
            frame = rng.choice(ids).to_bytes(2, "little") + header if apt else rng.choice(COMMANDS)
            controller.write(frame)
            controller.advance(rng.choice((0.001, 0.1, 2)))
            said += controller.read() + b"|"
        print(name, len(said), hashlib.sha256(said).hexdigest())
"""


def session(seed: int, hashes: str) -> list[str]:
    """Return two lines for each unit, without faults and with faults."""
    done = subprocess.run(
        [sys.executable, "-c", f"SEED = {seed}\n{PROGRAM}"],
        env={**os.environ, "PYTHONHASHSEED": hashes},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def first() -> list[str]:
    return session(1, "1")


def test_another_process_produces_the_same_bytes(first: list[str]) -> None:
    assert len(first) == 2 * len(simulated_units())
    assert session(1, "2") == first


FEW = 12
"""Units with few values, such as the MFF101, may answer the few messages of a session alike."""


def test_another_seed_produces_other_bytes(first: list[str]) -> None:
    alike = set(session(2, "1")[1::2]) & set(first[1::2])
    assert len(alike) <= FEW
