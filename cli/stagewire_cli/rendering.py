"""Decoded frames for people: every field with its offset, raw value and meaning.

For invalid bytes: the wrong bytes, and the expected ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from stagewire.errors import CodecError
from stagewire.protocols import Frame, Protocol
from stagewire_cli.output import printable, table
from stagewire_cli.real_numbers import range_text, real_text
from stagewire_conformance.answers import ADDRESSES
from stagewire_conformance.registry import Registry, registry_of
from stagewire_conformance.scales import factor

if TYPE_CHECKING:
    from rich.table import Table

    from stagewire import Scale
    from stagewire_cli.stage_values import StageValues

Json = dict[str, Any]
_HEX_FROM = 10


def frame_title(protocol: Protocol, answer: Json) -> str:
    """Return the title of a frame: message, id, form and addresses."""
    registry = registry_of(protocol)
    entry = registry.messages.get(answer["message"], {})
    known = ""
    if entry.get("id") is not None:
        place = registry.where(entry["pages"], entry.get("overlay", ""))
        known = f" ({spelled_id(registry, entry)}, {place})"
    whom = [f"{key} {_address(registry, key, answer[key])}" for key in ADDRESSES if key in answer]
    return f"{answer['message']}{known}\n{', '.join(['form ' + answer['form'], *whom])}"


def spelled_id(registry: Registry, entry: Json) -> str:
    """Return the id of a message, or the byte of a command, in the format of the documents."""
    if entry["kind"] == "message":
        size = registry.data["framing"].get("id", {}).get("size", 2)  # only packets state it
        part = f", sub-message {entry['sub_message']}" if "sub_message" in entry else ""
        return f"id {entry['id']:#0{2 + 2 * size}x}{part}"
    return f"{'setup byte' if entry['kind'] == 'setup' else 'byte'} {entry['id']:#04x}"


def frame_table(protocol: Protocol, answer: Json, units: StageValues | None = None) -> Table:
    """Return the fields of a decoded frame as a table; ``units`` gives those of a stage."""
    known = registry_of(protocol).fields(answer["message"], answer["form"])
    parameters = _parameters(protocol, answer)
    shown = table("offset", "field", "raw", "meaning", right=("offset", "raw"))
    for name, value in answer["fields"].items():
        field = known.get(name, {})
        offset = field.get("offset")
        place = "" if offset is None or name in parameters else str(offset)
        raw = f"{value:#x}" if field.get("real") else _raw_text(value)
        shown.add_row(place, name, raw, _meaning(field, value, units))
    for key, text in (("extra", "bytes beyond the layout"), ("data", "the whole packet")):
        if answer.get(key):
            shown.add_row("", key, answer[key], text)
    return shown


def frame_line(protocol: Protocol, answer: Json, units: Mapping[str, float] | None = None) -> str:
    """Return a decoded frame in one line, for streams; ``units`` are further words, such as position_mm."""
    known = registry_of(protocol).fields(answer["message"], answer["form"])
    words = [
        f"{name}={_value_text(known.get(name, {}), value)}"
        for name, value in answer["fields"].items()
    ]
    words += [f"{key}={answer[key]}" for key in ("extra", "data") if answer.get(key)]
    words += [f"{name}={value:.10g}" for name, value in (units or {}).items()]
    if "dest" in answer:
        whom = _between(answer["source"], answer["dest"])
    elif "axis" in answer:
        whom = f"axis {_address(registry_of(protocol), 'axis', answer['axis'])}"
    elif "address" in answer:
        whom = f"{answer['address']:#04x}"
    else:
        whom = answer.get("kind", "")  # a packet may have no address
    return _line(whom, answer["message"], answer["form"], words)


def event_line(frame: Frame, fields: str) -> str:
    """Return the same as :func:`frame_line`, from the text of all fields."""
    words = [fields] if fields else []
    if frame.extra:
        words.append(f"extra={frame.extra.hex()}")
    layout = frame.message.layout
    return _line(_between(frame.source, frame.dest), layout.message, layout.form, words)


def _between(source: int, dest: int) -> str:
    return f"{source:#04x}->{dest:#04x}"


def _line(whom: str, message: str, form: str, words: list[str]) -> str:
    shown = "" if form in ("header", "data", "request") else f" ({form})"
    return " ".join([*([whom] if whom else []), f"{message}{shown}", *words])


def _address(registry: Registry, kind: str, value: int) -> str:
    """Return an address; for an axis, with its name in the document."""
    axes = registry.axes if kind == "axis" else {}
    names = [f"({name})" for name, axis in axes.items() if axis["value"] == value]
    return " ".join([f"{value:#04x}", *names])


def _raw_text(value: int | str | list[int], joint: str = " ") -> str:
    """Return a raw value as printable text, with ``joint`` between the integers of an array."""
    if isinstance(value, list):
        return joint.join(map(str, value))
    return printable(value) if isinstance(value, str) else str(value)


def _value_text(field: Json, value: int | str | list[int]) -> str:
    """Return a value in one word: the number of a bit pattern, or the raw value."""
    if field.get("real") and isinstance(value, int):
        return real_text(field, value)
    return _raw_text(value, ",")


def _meaning(field: Json, value: int | str | list[int], units: StageValues | None) -> str:
    """Return the meaning of a raw value: a name, flag names, engineering units; empty if unknown."""
    if isinstance(value, list):
        return f"rows of {columns_text(field)}"
    if isinstance(value, str):
        return ""
    parts = [real_text(field, value)] if field.get("real") else []
    if field.get("enum"):
        names = [name for name, known in field["enum"].items() if known == value]
        parts.append(names[0] if names else "no name in the registry")
    if field.get("enums_by_unit"):
        parts.append(f"names depend on the unit: {', '.join(field['enums_by_unit'])}")
    if field.get("flags"):
        parts.append(_flag_names(field["flags"], value))
    if field.get("flags_by_unit"):
        parts.append(f"flags depend on the unit: {', '.join(field['flags_by_unit'])}")
    if field.get("scale"):
        own = None if units is None else units.of_field(field)
        parts.append(_in_units(field, value) if own is None else _with_unit(own, value))
    if field.get("role") == "reserved" and value:
        parts.append("reserved, not zero")
    minimum, maximum = field.get("minimum"), field.get("maximum")
    if minimum is not None and maximum is not None and not minimum <= value <= maximum:
        parts.append(f"out of range {range_text(field)}")
    if not parts and value >= _HEX_FROM:
        parts.append(f"{value:#x}")
    return "; ".join(part for part in parts if part)


def columns_text(field: Json) -> str:
    """Return the columns of an array."""
    return ", ".join(
        f"{column['name']} for each bit of {column['each']}" if column["each"] else column["name"]
        for column in field["array"]["columns"]
    )


def _flag_names(flags: dict[str, int], value: int) -> str:
    """Return the names of the bits that are set, and bits without a name in hex."""
    value &= (1 << 64) - 1
    names = [name for name, mask in sorted(flags.items(), key=lambda f: f[1]) if value & mask]
    for mask in flags.values():
        value &= ~mask
    return " | ".join([*names, *([f"{value:#x}"] if value else [])]) or "none set"


def _amount(value: Fraction) -> str:
    """Return a fraction as a decimal, marked with ≈ if it is rounded."""
    whole = value.denominator
    for prime in (2, 5):
        while whole % prime == 0:
            whole //= prime
    text = f"{float(value):.10g}"
    return text if whole == 1 and Fraction(text) == value else f"≈ {float(value):.6g}"


def _with_unit(scale: Scale, value: int) -> str:
    return f"{_amount(scale.from_counts(value))} {scale.unit}"


def _in_units(field: Json, value: int) -> str:
    scale, unit = field["scale"], field.get("unit") or ""
    exact = factor(scale, unit)
    if exact is not None:
        return _with_unit(exact, value)
    if "unknown" in scale:
        return f"{unit}: {scale['unknown']}" if unit else str(scale["unknown"])
    on = {
        "stage": "stage and controller",
        "setting": str(scale.get("setting", "a setting")).replace("_", " "),
        "unit": "unit",
    }.get(str(scale.get("by")), "a setting")
    return f"{unit or 'scale'}, depending on {on}"


def _parameters(protocol: Protocol, answer: Json) -> set[str]:
    layout = registry_of(protocol).layout(answer["message"], answer["form"]) or {}
    found = (layout.get(key) for key in ("param1", "param2"))
    return {field["name"] for field in found if field}


_SHOWN = 64
_BEFORE = 6  # bytes shown before the wrong ones


def explain(raw: bytes, error: CodecError, hints: Iterable[str]) -> Iterator[str]:
    """Yield lines that show the bytes, mark the wrong ones and state the expected ones."""
    wrong = error.at or range(0)
    start = max(0, min(wrong.start - _BEFORE, len(raw) - _SHOWN)) if wrong.start > _SHOWN else 0
    shown = range(start, min(max(len(raw), wrong.start + 1), start + _SHOWN))
    lead = "... " if start else ""
    more = " ..." if shown.stop < len(raw) else ""
    cells = [f"{raw[i]:02X}" if i < len(raw) else "  " for i in shown]
    yield f"{lead}{' '.join(cells)}{more}".rstrip()
    if wrong:
        marks = ["^^" if i in wrong else "  " for i in shown]
        yield f"{' ' * len(lead)}{' '.join(marks)}".rstrip()
    yield f"{error.code}: {error}"
    yield from (f"hint: {hint}" for hint in hints)
