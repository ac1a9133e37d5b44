"""Whether the values of a message are among those that the document has."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from stagewire.protocols import FramedMessage
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.registry import Json


_ALWAYS_ZERO: Final = frozenset({"min_velocity", "jog_min_velocity"})
"""Start velocities, which are always zero (pages 30 and 32): stated of the controller, not of the field."""

_UNNAMED: Final = {"param1": 2, "param2": 3}
"""Where parameters of a header stand that have no meaning."""


@dataclass(frozen=True)
class Fault:
    """Something in a message that the document does not have.

    :param text: a sentence.
    :param grave: whether the document excludes it; else it is only not meant so, such as a 0 in a field
        that begins with 1, which nobody has set yet.
    """

    text: str
    grave: bool = True


def faults_of(declared: Declaration, message: FramedMessage) -> Iterator[Fault]:
    """Give what is wrong by the document with the values of a message that came.

    The channel is left out: whether it is the right one depends on what was asked. So are the texts by which
    a unit says what it is, which have a check of their own.
    """
    layout = message.layout
    values = message.values()
    identifies = declared.registry.messages[layout.message].get("tells") == "identity"
    for name, field in declared.registry.fields(layout.message, layout.form).items():
        if field["role"] != "value" or name == getattr(declared.protocol, "channel", None):
            continue
        if field["kind"] == "integer":
            yield from _faults(name, field, values[name])
        elif field["kind"] == "text" and not identifies and not is_readable(values[name]):
            yield Fault(f"{name} is {values[name]!r}; it should be text", grave=False)
    yield from map(Fault, unused_parameters(message))


def unused_parameters(message: FramedMessage) -> Iterator[str]:
    """Give what is wrong with the parameters of a header to which its message gives no meaning."""
    layout = message.layout
    for name in layout.unnamed:
        came, due = getattr(message, name), layout.constants.get(name, 0)
        if came != due:
            at = _UNNAMED[name]
            yield f"byte {at} is {came:#04x}; it has no meaning here, and should be {due:#04x}"


def is_readable(text: str) -> bool:
    """Return whether a text can be read as far as it goes; what is behind a NUL is no part of it."""
    read = text.partition("\0")[0]
    return read.isascii() and (read.isprintable() or not read)


def _faults(name: str, field: Json, value: Any) -> Iterator[Fault]:
    table, flags = field.get("enum"), field.get("flags")
    is_open = field.get("open", False)
    if name in _ALWAYS_ZERO:
        if value:
            yield Fault(f"{name} is {value}; it is always zero at present")
    elif flags and not is_open:
        if more := value & ~sum(flags.values()):
            yield Fault(
                f"{name} is {value:#x}; the bits {more:#x} of it stand for nothing in the document"
            )
    elif table and not is_open and "modifiers" not in field:
        if value not in table.values():
            known = ", ".join(
                f"{each} ({key})" for key, each in sorted(table.items(), key=lambda item: item[1])
            )
            yield Fault(f"{name} is {value}; the document has {known}")
    elif not field["minimum"] <= value <= field["maximum"]:
        yield Fault(
            f"{name} is {value}; the document has {field['minimum']} to {field['maximum']}",
            grave=bool(value),
        )
