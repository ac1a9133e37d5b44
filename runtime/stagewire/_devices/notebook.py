"""Devices and their parts as HTML for notebooks.

Displaying a device sends nothing: the identity, the stages and the values that were read last are known.
"""

from __future__ import annotations

from html import escape
from typing import Any

from stagewire._devices.connection import Connection
from stagewire._devices.renderings import html_of_values, short, table
from stagewire._devices.stages import Place
from stagewire._devices.values import Values


def html_of_part(
    name: str, description: str, connection: Connection[Any], only: Place | None
) -> str:
    """Return a device, or a part of it, as HTML: what it is, and the values that were last read.

    :param description: several lines; the first is the title.
    :param only: address and channel of the part; None for the whole device.
    """
    title, *lines = description.splitlines()
    serial = (
        None if connection.info is None else getattr(connection.info.message, "serial_number", None)
    )
    rows = [("unit", name), ("serial number", "unknown" if serial is None else str(serial))]
    rows.append(("port", connection.url))
    shown = [one for one in connection.places.items() if only in (one[0], None)]
    for place, part in shown:
        title_of_stage = "stage" if len(shown) == 1 else f"stage {_part(part)}"
        rows.append((title_of_stage, connection.stages.described(place)))
    known = [values for place, values in connection.latest() if only in (place, None)]
    parts = [table(title, rows)]
    parts += [
        f'<details open="">{_summary(values)}{html_of_values(values)}</details>' for values in known
    ]
    parts.append(
        f"<details><summary>limits and scales</summary><pre>{escape(chr(10).join(lines))}</pre></details>"
    )
    state = (
        "these values were received last"
        if known
        else "no values were received since it was opened"
    )
    parts.append(
        f"<p>Displaying this sends nothing: {state}. <code>get_…()</code> reads new ones.</p>"
    )
    return f"<div>{''.join(parts)}</div>"


def _part(name: object) -> str:
    return f"{name[0]} channel {name[1]}" if isinstance(name, tuple) else str(name)


def _summary(values: Values[Any]) -> str:
    return f"<summary>{escape(short(values).strip('<>'))}</summary>"
