"""Values in a received message that the document does not allow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from stagewire.devices import number_of
from stagewire.protocols import FramedMessage

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.registry import Json

_ALWAYS_ZERO: Final = frozenset({"min_velocity", "jog_min_velocity"})
"""Start velocities. Pages 30 and 32 state that they are always zero: of the controller, not of the field."""

UNNAMED: Final = {"param1": 2, "param2": 3}
"""Byte offsets of the header parameters that have no meaning."""


@dataclass(frozen=True)
class Fault:
    """An undocumented value in a message.

    :param field: the name of the field.
    :param text: a sentence.
    :param grave: whether the document excludes the value. Otherwise it is merely not intended, such as a 0
        that was never set in a field whose range starts at 1.
    :param is_range: whether it is a number outside its range.
    """

    field: str
    text: str
    grave: bool = True
    is_range: bool = False


def faults_of(declared: Declaration, message: FramedMessage) -> Iterator[Fault]:
    """Yield the values in a received message that the document does not allow.

    The channel is left out: which one is right depends on the request. Identity texts have a check of their
    own.
    """
    layout = message.layout
    values = message.values()
    identifies = declared.registry.messages[layout.message].get("tells") == "identity"
    for name, field in declared.registry.fields(
        layout.message, layout.form, declared.unit.name
    ).items():
        if field["role"] != "value" or name == getattr(declared.protocol, "channel", None):
            continue
        if field["kind"] == "integer":
            yield from _faults(name, field, values[name])
        elif field["kind"] == "text" and not identifies and not is_readable(values[name]):
            yield Fault(name, f"{name} is {values[name]!r}; it should be text", grave=False)
    yield from unused_parameters(message)


def undocumented_values(fields: Mapping[str, Json], values: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield the undocumented numbers among values, by the registry entries of their fields."""
    for name, value in values.items():
        if fields[name]["kind"] == "integer":
            yield from _faults(name, fields[name], value)


def unused_parameters(message: FramedMessage) -> Iterator[Fault]:
    """Yield what is wrong with the header parameters that the message does not use."""
    layout = message.layout
    for name in layout.unnamed:
        came, due = getattr(message, name), layout.constants.get(name, 0)
        if came != due:
            at = UNNAMED[name]
            yield Fault(
                name,
                f"byte {at} is {came:#04x}; this message does not use it, so it should be "
                f"{due:#04x}",
            )


def is_readable(text: str) -> bool:
    """Return whether a text is readable up to its first NUL."""
    read = text.partition("\0")[0]
    return read.isascii() and (read.isprintable() or not read)


def _faults(name: str, field: Json, value: Any) -> Iterator[Fault]:
    table, flags = field.get("enum"), field.get("flags")
    is_open = field.get("open", False)
    low, high = field["minimum"], field["maximum"]
    if name in _ALWAYS_ZERO:
        if value:
            yield Fault(name, f"{name} is {value}; it is always zero at present")
    elif flags and not is_open:
        if more := value & ~sum(flags.values()):
            yield Fault(
                name, f"{name} is {value:#x}; the document does not define the bits {more:#x}"
            )
    elif table and not is_open:
        table = {key: each for key, each in table.items() if low <= each <= high}
        modifiers = {table[each] for each in field.get("modifiers", ())}
        if value & ~sum(modifiers) not in set(table.values()) - modifiers:
            known = ", ".join(
                f"{each} ({key})" for key, each in sorted(table.items(), key=lambda item: item[1])
            )
            yield Fault(name, f"{name} is {value}; the document defines {known}")
    elif not low <= value <= high:
        came, least, most = (
            f"{number_of(each, field['size']):g}" if field.get("real") else str(each)
            for each in (value, low, high)
        )
        text = f"{name} is {came}; the document allows {least} to {most}"
        yield Fault(name, text, grave=bool(value), is_range=True)
