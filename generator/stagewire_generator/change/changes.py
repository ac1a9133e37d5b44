"""Changes between two registries: their kinds, classes and plain data.

A kind has one class. An attribute that may change in ways of different classes has as many kinds. The
plain data follow ``spec/schema/changes.schema.json``.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from stagewire_generator.model import Json


class ChangeClass(enum.IntEnum):
    """How grave a change is; the graver one is the greater."""

    DOC = 1
    """Texts, pages, errata, examples; no program notices."""
    SOURCE = 2
    """Generated names or types change; the bytes do not."""
    WIRE = 3
    """Bytes change or become ambiguous, or are refused where they were sent."""


@dataclass(frozen=True, slots=True)
class Change:
    """One difference between two registries.

    :param kind: slug of the kind, a key of ``KINDS``.
    :param level: the class, which follows from the kind.
    :param where: what it is about, from the outermost in: ``{"message": …, "form": …, "field": …}``.
        Where something was renamed, its new name.
    :param old: as a person reads it; None where there was nothing.
    :param new: as a person reads it; None where there is nothing any more.
    :param text: what it means, in a sentence.
    :param overlay: the overlay of the protocol that changes so; "" for the protocol itself.
    """

    kind: str
    level: ChangeClass
    protocol: str
    where: Mapping[str, str]
    old: str | None
    new: str | None
    text: str
    overlay: str = ""

    @property
    def title(self) -> str:
        """What changes: ``PROTOCOL``, or ``PROTOCOL/OVERLAY``."""
        return f"{self.protocol}/{self.overlay}" if self.overlay else self.protocol


def worst(changes: Iterable[Change]) -> ChangeClass | None:
    """Return the gravest class among the changes; None if there are none."""
    return max((change.level for change in changes), default=None)


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of change: its class, and a sentence on what it means."""

    level: ChangeClass
    meaning: str


_WIRE = {
    "protocol-removed": "none of its frames is known any more",
    "overlay-removed": "what it adds or lays out otherwise can no longer be asked for",
    "framing": "frames are cut out of the stream otherwise",
    "message-removed": "its frames are no longer known",
    "message-id": "the message has other header bytes",
    "message-direction": "its frames are taken from another side, or from one side only",
    "message-kind": "other bytes begin it: it was another kind of message or command",
    "command-size": "another number is sent in the size slot, or the slot is left out",
    "command-dummy": "commands that were sent are refused as a dummy, or the other way round",
    "setup-switch": "what follows the setup command is read in another format",
    "addressee": "in a rack it goes to another address",
    "call-default": "another value is sent where a caller gives none",
    "exchange": "other messages are sent or waited for, or at another time",
    "layout-added": "packets that were refused, or read otherwise, are now read by this layout",
    "layout-removed": "packets of this layout are refused, or read by another one",
    "layout-context": "another context decides which layout the bytes have",
    "layout-length": "the packet has another length",
    "layout-only-zero": "a stream takes other headers for this message",
    "field-added": "bytes of the frame are now this field, and were none or another",
    "field-removed": "bytes of the frame are no longer this field",
    "field-offset": "the field stands in another place",
    "field-format": "the same value makes other bytes",
    "field-role": "what is sent for the field when it is left out, or must be given, changes",
    "field-range": "values that were sent are refused, or the other way round",
    "field-constant": "another value is sent",
    "field-scale": "the field is converted by another scale: the same value makes other bytes",
    "value-number": "the same name makes other bytes",
    "bit-number": "the same name stands for another bit",
    "quantity-unit": "the same number is taken in another unit",
    "scale": "the same value in the unit makes other bytes",
    "scale-removed": "conversions that worked are refused",
    "setting": "another message, field or value tells what a scale depends on",
    "controller-unit-removed": "conversions for this unit are refused, or made with another scale",
    "address": "frames go to another address",
    "unit-address": "frames for the unit go to another address",
    "unit-channels": "the unit has other channels or bays to be addressed",
    "unit-prefix": "a serial number is taken for another unit",
    "unit-status": "the status of the unit is read by another layout",
    "unit-keep-alive": "another message keeps the unit awake",
    "unit-rate": "the unit sends its status at another rate",
    "unit-baud-rates": "the serial line of the unit has other rates",
    "unclassified": "the kind of this fact is not known, so that it counts as the gravest",
}
_SOURCE = {
    "protocol-added": "new names; streams of this protocol can now be read",
    "overlay-added": "new names, for whoever asks for the overlay; for all others nothing changes",
    "protocol-renamed": "the protocol is found under another name",
    "package": "the Python package is imported under another name",
    "module-added": "a new module of messages",
    "module-removed": "the module of messages is gone",
    "module-renamed": "the module of messages has another name",
    "message-added": "new names; frames with this id were unknown and are now framed and read",
    "message-renamed": "the classes have other names; the bytes are the same",
    "message-id-added": "the message had no id; its frames were unknown and are now framed and read",
    "message-module": "the classes stand in another module",
    "message-words": "generated names are made of other words",
    "message-set": "the message belongs to another parameter set",
    "mention-added": "a name is known as that of a message without an id",
    "mention-removed": "a name is no longer known as that of a message without an id",
    "set-added": "a new parameter set",
    "set-removed": "the parameter set is gone; its messages are reported by themselves",
    "set-renamed": "the parameter set has another name",
    "set-members": "the parameter set has other members",
    "layout-renamed": "the form, and perhaps its class, has another name; the bytes are the same",
    "class-renamed": "the class has another name",
    "call": "methods of device classes have another name",
    "parameter-named": "a parameter byte that had no name has one, and must now be given",
    "parameter-unnamed": "a parameter byte has lost its name, and may be left out",
    "field-renamed": "the field has another name; the bytes are the same",
    "field-type": "the same bytes are text in one, bytes in the other",
    "field-quantity": "the field has gained, lost or renamed its quantity; the scale is not another",
    "field-target": "travel limits hold for the field, or hold no longer",
    "field-enumeration": "the field gets its names from another enumeration, or none",
    "field-flags": "the field gets the names of its bits from another table, or none",
    "field-flags-by-unit": "on some units the bits get their names from another table",
    "field-open": "device classes refuse unlisted values or bits of the field, or accept them again",
    "enumeration-added": "a new enumeration",
    "enumeration-removed": "the enumeration is gone",
    "enumeration-renamed": "the enumeration has another name; its values are the same",
    "enumeration-open": "device classes refuse unlisted values of the enumeration, or accept them again",
    "value-added": "a new name for a value that was kept as a number",
    "value-removed": "the value has no name any more; as a number it is kept",
    "value-modifier": "device classes take the value together with others, or by itself",
    "value-renamed": "the value has another name; the number is the same",
    "flags-added": "a new flag table",
    "flags-removed": "the flag table is gone",
    "flags-renamed": "the flag table has another name; its bits are the same",
    "flags-open": "device classes refuse unlisted bits of the table, or accept them again",
    "bit-added": "a new name for a bit",
    "bit-removed": "the bit has no name any more; its value is kept",
    "bit-motion": "whether something moves is told by other bits",
    "hindrance": "another state is named as what keeps something from moving",
    "motion-target": "where a motion is to end is known from another fact",
    "fault-report": "another message is taken for a fault report, or is read otherwise as one",
    "effect": "programs that ask before they move something ask for other messages",
    "bit-renamed": "the bit has another name; its number is the same",
    "quantity-added": "a new quantity",
    "quantity-removed": "the quantity is gone; its fields are reported by themselves",
    "quantity-renamed": "the quantity has another name; unit and scale are the same",
    "scale-added": "conversions that were refused now work",
    "setting-added": "a new setting that scales depend on is known",
    "setting-removed": "what tells the setting is no longer known",
    "scale-form": "the scale is written the other way round or under another key; it is the same",
    "scale-refusal": "that the scale is unknown was said with a reason, or without one",
    "stage-added": "a new stage",
    "stage-removed": "the stage is gone",
    "stage-renamed": "the stage has another name; its scales are the same",
    "stage-limit": "calls of device classes are refused beyond another limit of the stage, or no longer",
    "controller-added": "a new group of units that scale alike",
    "controller-removed": "the group of units is gone; the scales are reported with the stages",
    "controller-renamed": "the group has another name; its units are the same",
    "controller-unit-added": "conversions for this unit now work by its own name",
    "unit-added": "a new unit",
    "unit-removed": "the unit is gone",
    "unit-messages": "the unit is given the messages of another list or family",
    "unit-stages": "other stages are known on the unit",
    "unit-pause": "clients leave another pause after what has no reply",
    "unit-also-at": "other addresses are known that the units answer to besides their own",
    "family-added": "a new family of units",
    "family-removed": "the family of units is gone",
    "list-added": "a new list of messages",
    "list-removed": "the list of messages is gone",
    "list-messages": "the units of this list or family have other messages",
    "alias-added": "a unit newer than the document is known",
    "alias-removed": "a unit newer than the document is no longer known",
    "unit-model": "other reported models are taken for the unit",
    "prefix-added": "serial numbers with this prefix are now known",
    "prefix-shared": "the prefix is that of other units as well, or no longer; the reported model decides",
    "prefix-removed": "serial numbers with this prefix are no longer known",
}
_DOC = {
    "text": "another text",
    "page": "another page",
    "order": "the same entries in another order",
    "document": "another document, or other facts about it",
    "name-prefix": "the document's prefix of names, which the registry drops",
    "format": "the table of formats; fields whose bytes change are reported by themselves",
    "context": "a context or its values; layouts that it decides are reported by themselves",
    "chapter-added": "a chapter without messages",
    "chapter-removed": "a chapter without messages",
    "chapter-renamed": "a chapter without messages",
    "parameter-zero": "that a parameter byte without a name is always zero was said, or is now",
    "field-format-name": "the format has another name; size, sign and kind are the same",
    "field-default": "the default that the document gives; nothing sends it by itself",
    "flags-format": "the format for which the bits are listed; fields are reported by themselves",
    "limit-note": "where the limit is from, or why it is unknown",
    "scale-note": "how the scale is printed, where it is from, or why it is unknown",
    "keyboard": "what is typed for a byte",
    "value-reserved": "whether the document reserves the value for future use",
    "firmware": "what depends on the firmware of the controller",
    "hardware-type": "what a hardware type stands for",
    "erratum-added": "a new erratum",
    "erratum-removed": "the erratum is gone",
    "erratum-renamed": "the erratum has another slug",
    "erratum": "what the erratum says",
    "rule-added": "a new rule of the document",
    "rule-removed": "the rule is gone",
    "rule-renamed": "the rule has another slug",
    "rule": "what the rule says, how strong it is, or whom it binds",
    "example-added": "a new worked example or capture",
    "example-removed": "the worked example or capture is gone",
    "example": "what the worked example or capture says",
}  # fmt: skip

KINDS: dict[str, Kind] = {
    kind: Kind(level, meaning)
    for level, table in (
        (ChangeClass.WIRE, _WIRE),
        (ChangeClass.SOURCE, _SOURCE),
        (ChangeClass.DOC, _DOC),
    )
    for kind, meaning in table.items()
}
"""Slug -> kind, the gravest first."""


SCHEMA_VERSION = 1


def counts(changes: Sequence[Change]) -> dict[ChangeClass, int]:
    """Return how many changes each class has, the gravest first."""
    levels = [change.level for change in changes]
    return {level: levels.count(level) for level in sorted(ChangeClass, reverse=True)}


def report(old: str, new: str, changes: Sequence[Change]) -> Json:
    """Return the changes from ``old`` to ``new``, which are named as the user named them."""
    return {
        "schema_version": SCHEMA_VERSION,
        "old": old,
        "new": new,
        "counts": {level.name: number for level, number in counts(changes).items()},
        "changes": [
            {
                "class": change.level.name,
                "kind": change.kind,
                "protocol": change.protocol,
                **({"overlay": change.overlay} if change.overlay else {}),
                "where": dict(change.where),
                "old": change.old,
                "new": change.new,
                "text": change.text,
            }
            for change in changes
        ],
    }
