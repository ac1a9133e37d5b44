"""Rules for specs with a packet framing: the parts must fit together, and every message must fit."""

from __future__ import annotations

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.framing import Rules
from stagewire_generator.lint.witness.lists import MESSAGE_CHAPTERS
from stagewire_generator.lint.witness.witness import Witness
from stagewire_generator.model import Json, Message, Protocol
from stagewire_generator.strict_yaml import Document

_ALWAYS = ("start", "length", "id", "payload")
_NUMBERS = ("length", "address", "id", "check")
_NOT_COVERED = ("check", "end")
_WORDS = ("polynomial", "initial", "final")
_LONGEST = 4  # bytes of a length, an address or an id
_SEE = "correct `order`, or the other keys of `framing`"
_STUFFED = {b"\xff\xff\xfd": "Dynamixel 2.0"}
"""First bytes of packets whose payload is sent with byte stuffing."""


def check_packets(protocol: Protocol, head: Document, diagnostics: Diagnostics) -> None:
    """Check the order, numbers and check of packets, and whether the messages fit.

    :param head: the file of the protocol, for the places of errors.
    """
    rules = _Rules(protocol, head, diagnostics)
    rules.order()
    rules.references()
    rules.stuffing()
    if rules.numbers():
        rules.length()
        rules.check()
        for message in protocol.messages:
            rules.id(message)
    for message in protocol.messages:
        _layouts(message, diagnostics)


class _Rules:
    """The rules for a framing, one per method."""

    def __init__(self, protocol: Protocol, head: Document, diagnostics: Diagnostics) -> None:
        self.framing: Json = protocol.framing
        self.formats: Json = protocol.formats
        self.order_of_parts: list[str] = self.framing["order"]
        self.head = head
        self.diagnostics = diagnostics

    def refuse(self, what: str, *path: str, code: str = "SW038", hint: str = _SEE) -> None:
        """Report an error of the framing at ``path``."""
        place = self.head.place("framing", *path)
        self.diagnostics.add(place, code, f"framing: {what}", hint)

    def order(self) -> None:
        """Check the order: start, then length and id, the payload, a check, and end last."""
        order = self.order_of_parts
        for part in _ALWAYS:
            if part not in order:
                self.refuse(f"{part} is missing from `order`", "order")
        for part in order:
            if part != "payload" and part not in self.framing:
                self.refuse(f"`order` lists {part}, but `framing` does not define it", "order")
        for part in ("address", "check", "end"):
            if part in self.framing and part not in order:
                self.refuse(f"{part} is missing from `order`", part)
        if "start" in order and order[0] != "start":
            self.refuse("start is not the first part", "order")
        if "end" in order and order[-1] != "end":
            self.refuse("end is not the last part", "order")
        if "payload" not in order:
            return
        payload = order.index("payload")
        for part in ("length", "id"):
            if part in order and order.index(part) > payload:
                self.refuse(f"{part} comes after the payload", "order")
        if "check" in order and order.index("check") < payload:
            self.refuse("check comes before the payload", "order")

    def references(self) -> None:
        """Check that the length counts, and the check covers, parts of the packet."""
        counts = self.framing["length"]["counts"]
        self._parts(counts, "length", "counts")
        if "payload" not in counts:
            self.refuse("the length does not count the payload", "length", "counts")
        covers = self.framing.get("check", {}).get("covers", [])
        self._parts(covers, "check", "covers")
        for part in _NOT_COVERED:
            if part in covers:
                self.refuse(f"the check cannot cover {part}", "check", "covers")

    def stuffing(self) -> None:
        """Refuse packets of known protocols that insert bytes into the payload."""
        start = bytes(self.framing["start"])
        for marks, name in _STUFFED.items():
            if start.startswith(marks):
                what = f"packets that begin with {marks.hex(' ').upper()} are those of {name}"
                what = f"{what}, which inserts bytes into the payload (byte stuffing)"
                hint = (
                    "Stagewire sends payloads as they are and cannot describe this protocol yet; see "
                    "`Supported packet structures` in docs/tutorials/your-own-protocol.md"
                )
                self.refuse(what, "start", hint=hint)

    def _parts(self, named: list[str], part: str, key: str) -> None:
        for other in named:
            if other not in self.order_of_parts:
                self.refuse(f"{part}.{key} names {other}, which is missing from `order`", part, key)

    def numbers(self) -> bool:
        """Check that numbers are short and unsigned; return whether all sizes are known."""
        numbers = [part for part in _NUMBERS if part in self.framing]
        for part in numbers:
            name = self.framing[part]["format"]
            hint = "choose another format"
            if self.formats.get(name, {}).get("signed"):
                self.refuse(
                    f"{part} has the format {name}, which is signed", part, "format", hint=hint
                )
            if part != "check" and self.framing[part].get("size", 0) > _LONGEST:
                what = f"{part} has the format {name}; at most {_LONGEST} bytes are allowed"
                self.refuse(what, part, "format", hint=hint)
        return all("size" in self.framing[part] for part in numbers)

    def length(self) -> None:
        """Check that the length of the longest payload fits its format."""
        sizes = {part: self.framing[part]["size"] for part in _NUMBERS if part in self.framing}
        sizes |= {part: len(self.framing.get(part, ())) for part in ("start", "end")}
        sizes["payload"] = self.framing["maximum_length"]
        most = sum(sizes.get(part, 0) for part in self.framing["length"]["counts"])
        size = self.framing["length"]["size"]
        if most >= 1 << 8 * size:
            what = f"a length of {most} does not fit into {size} byte{'s' * (size > 1)}"
            hint = "reduce maximum_length, or choose a longer format"
            self.refuse(what, "length", code="SW033", hint=hint)

    def check(self) -> None:
        """Check that an exclusive or has one byte, and that the numbers of a CRC fit its size."""
        check = self.framing.get("check", {})
        size = check.get("size", 0)
        if check.get("method") == "xor" and size != 1:
            self.refuse("an exclusive or has one byte", "check", "format")
        for word in _WORDS:
            if check.get(word, 0) >= 1 << 8 * size:
                what = f"{word} {check[word]:#x} has more than {8 * size} bits"
                hint = "correct the number, or the format of the check"
                self.refuse(what, "check", word, code="SW033", hint=hint)

    def id(self, message: Message) -> None:
        """Check that the id of a message fits its format."""
        size = self.framing["id"]["size"]
        if message.id is not None and message.id >= 1 << 8 * size:
            what = f"{message.name}: the id {message.id:#x} does not fit into {size} byte{'s' * (size > 1)}"
            hint = "correct the id, or the format of the id in protocol.yaml"
            self.diagnostics.add(message.place, "SW033", what, hint)


def _layouts(message: Message, diagnostics: Diagnostics) -> None:
    """Check that a message is only a payload, and that its forms differ in length."""
    if message.id is not None and not message.documented:
        what = f"{message.name}: a packet needs a layout"
        hint = "add one; `header: {}` is a layout without a payload"
        diagnostics.add(message.place, "SW038", what, hint)
    for layout in message.layouts:
        where = f"{message.name} ({layout.form})"
        if layout.only_zero:
            hint = "remove it: packets have no header parameters"
            diagnostics.add(
                layout.place, "SW038", f"{where}: packets do not support only_zero", hint
            )
        if layout.when:
            hint = "give the layouts different lengths, and remove the `when`"
            diagnostics.add(layout.place, "SW038", f"{where}: packets do not support `when`", hint)


RULES = Rules(
    check=check_packets,
    kinds=("message",),
    keys=(
        "maximum_length",
        "length/counts",
        *(f"check/{key}" for key in ("method", "covers", "complement", "reflected", *_WORDS)),
    ),
    lists=("order", "start", "end"),
    formats=_NUMBERS,
    same_length="give them different lengths: packets differ in nothing else",
    encode=(("address", "--address"),),
)
WITNESS = Witness(MESSAGE_CHAPTERS, sections=True)
