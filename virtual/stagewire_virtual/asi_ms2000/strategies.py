"""What the document leaves open, and the readings that a virtual controller can be told to follow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from stagewire_virtual.options import known_only

__all__ = ["STRATEGIES", "readings"]

STRATEGIES: Final[Mapping[str, Mapping[str, str]]] = {
    "power_on_mode": {
        "high": "After power-on and reset it takes lines of text (section 1: 255 66 leads out of it).",
        "low": "After power-on and reset it takes low-level commands.",
    },
    "colon_in_data": {
        "data": "As many bytes as the size says are data, a colon among them too (section 2, group 5).",
        "end": "Any colon ends the command and clears the buffer (section 2, RS-232 timeout).",
    },
    "prefix_in_frame": {
        "data": "255 begins a setup command where a command is due, and is data elsewhere.",
        "setup": "255 and the letter of a setup command are one anywhere; what was pending is forgotten.",
    },
    "missing_size": {
        "accepted": "Any command without data may leave its size out (examples of sections 7 and 14).",
        "ignored": "A command that reads is ignored without its size (section 2, group 3: three exceptions).",
    },
    "disabled_axis": {
        "not_busy": "A stopped axis is not busy wherever it stands (section 16, from firmware 3.3 on).",
        "busy": "A stopped axis is busy while it stands away from its target (before firmware 3.3).",
    },
    "start_motor": {
        "resumes": "START_MOTOR lets a stopped axis go on to its target, which may be a new one.",
        "stays": "START_MOTOR only enables: the target becomes the place where the axis stands.",
    },
    "vector_speed": {
        "unsigned": "Vector speeds go from 0 to 65535 µm/s, upwards only (section 25 names no sign).",
        "signed": "Vector speeds go from -32768 to 32767 µm/s, as READ_CURRENT_SPEED returns them.",
    },
}
"""Strategy -> reading -> what the controller does then. The first reading is the default."""


def readings(unit: str, chosen: Mapping[str, str]) -> dict[str, str]:
    """Return the reading of every strategy: the one that was chosen, or the default.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a strategy or a reading that there is not.
    """
    known_only("strategy", chosen, STRATEGIES, unit)
    for name, reading in chosen.items():
        known_only(f"{name} that is", [reading], STRATEGIES[name], unit)
    return {name: next(iter(known)) for name, known in STRATEGIES.items()} | dict(chosen)
