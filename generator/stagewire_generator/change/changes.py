"""Changes between two registries: their kinds, classes and plain data.

Each kind has one class. An attribute whose changes can have different classes has several kinds. The plain
data follow ``spec/schema/changes.schema.json``.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from stagewire_generator.model import Json


class ChangeClass(enum.IntEnum):
    """The severity of a change; a graver class is greater."""

    DOC = 1
    """Texts, pages, errata, examples; programs are not affected."""
    SOURCE = 2
    """Generated names or types change; the bytes do not."""
    WIRE = 3
    """Bytes change, become ambiguous, or are refused although they were accepted before."""


@dataclass(frozen=True, slots=True)
class Change:
    """One difference between two registries.

    :param kind: slug of the kind, a key of ``KINDS``.
    :param level: the class, which follows from the kind.
    :param where: the changed thing, outermost part first: ``{"message": …, "form": …, "field": …}``. It has
        the new names of renamed things.
    :param old: the old value in readable form; None if there was none.
    :param new: the new value in readable form; None if there is none.
    :param text: the meaning of the change, in one sentence.
    :param overlay: the overlay that changed; "" for the protocol itself.
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
        """The changed protocol or overlay: ``PROTOCOL`` or ``PROTOCOL/OVERLAY``."""
        return f"{self.protocol}/{self.overlay}" if self.overlay else self.protocol


def worst(changes: Iterable[Change]) -> ChangeClass | None:
    """Return the gravest class among the changes, or None if there are no changes."""
    return max((change.level for change in changes), default=None)


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of change: its class, and its meaning in one sentence."""

    level: ChangeClass
    meaning: str


_WIRE = {
    "protocol-removed": "frames of this protocol are no longer recognised",
    "overlay-removed": "the messages and layouts of the overlay are no longer available",
    "parameter-omitted": "a parameter that a program leaves out is sent with another value, or is refused",
    "overlay-default": "the overlay is now in the default package, or no longer: frames are read differently",
    "framing": "frames are separated from the stream in a different way",
    "message-removed": "its frames are no longer recognised",
    "message-id": "the message has different header bytes",
    "message-sub-message": "another value in the bytes distinguishes the message from others with its id",
    "message-direction": "its frames are accepted from another side, or from one side only",
    "message-kind": "it begins with other bytes, because it is another kind of message or command",
    "command-size": "another number is sent in the size slot, or the slot is left out",
    "message-not-sent": "the message is no longer sent, is sent again, or is refused for another reason",
    "message-without-flag": "the message is received without the data flag, no longer, or for another reason",
    "command-dummy": "the command is now refused as a dummy, or no longer refused",
    "setup-switch": "the bytes after the setup command are read in another format",
    "addressee": "in a rack, the message is sent to another address",
    "call-default": "another value is sent if the caller does not give one",
    "exchange": "other messages are sent or waited for, or at another time",
    "layout-added": "packets that were refused or decoded with another layout are now decoded with this one",
    "layout-removed": "packets with this layout are now refused, or decoded with another layout",
    "layout-context": "the layout of the bytes depends on another context",
    "layout-sent-when": "device classes send the parameters in another length",
    "layout-length": "the packet has another length",
    "layout-only-zero": "the headers that are read as this message have changed",
    "field-added": "these bytes of the frame are a new field, or belonged to another field",
    "field-removed": "these bytes of the frame no longer belong to this field",
    "field-offset": "the field is at another position",
    "field-format": "the same value is encoded as different bytes",
    "field-role": "the field must now be given, may now be left out, or has another value when left out",
    "field-range": "values that were accepted are now refused, or the reverse",
    "field-constant": "another value is sent",
    "field-array": "the integers of an array are counted, encoded or converted in another way",
    "field-scale": "the field is converted with another scale: the same value gives different bytes",
    "value-number": "the same name is encoded as different bytes",
    "bit-number": "the same name refers to another bit",
    "quantity-unit": "the same number is interpreted in another unit",
    "scale": "the same value in the unit gives different bytes",
    "scale-removed": "conversions that worked are now refused",
    "setting": "the value that a scale depends on comes from another message, field or name",
    "controller-unit-removed": "conversions for this unit are refused, or use another scale",
    "address": "frames are sent to another address",
    "unit-address": "frames for the unit are sent to another address",
    "unit-channels": "the unit has other channels or bays",
    "unit-prefix": "a serial number identifies another unit",
    "unit-status": "the status of the unit is read with another layout",
    "unit-context": "messages of the unit are read with another layout",
    "unit-keep-alive": "another message is the keep-alive of the unit",
    "unit-rate": "the unit sends its status at another rate",
    "unit-baud-rates": "the serial line of the unit has other baud rates",
    "unclassified": "a change of unknown kind, which counts as the most serious class",
}
_SOURCE = {
    "protocol-added": "new names; streams of this protocol can now be read",
    "overlay-added": "new names when the overlay is selected; otherwise nothing changes",
    "protocol-renamed": "the protocol has another name",
    "package": "the Python package is imported under another name",
    "module-added": "a new module of messages",
    "module-removed": "the module of messages was removed",
    "module-renamed": "the module of messages has another name",
    "message-added": "new names; frames with this id were unknown and can now be read",
    "message-renamed": "the classes have other names; the bytes are the same",
    "message-id-added": "the message had no id; its frames were unknown and can now be read",
    "message-module": "the classes are in another module",
    "message-words": "generated names consist of other words",
    "message-alias": "another name of the message was added or removed",
    "message-set": "the message belongs to another parameter set",
    "mention-added": "a new name of a message without an id",
    "mention-removed": "the name of a message without an id was removed",
    "set-added": "a new parameter set",
    "set-removed": "the parameter set was removed; its messages are reported separately",
    "set-renamed": "the parameter set has another name",
    "set-members": "the parameter set has other members",
    "layout-renamed": "the form, and perhaps its class, has another name; the bytes are the same",
    "class-renamed": "the class has another name",
    "call": "methods of device classes have another name",
    "parameter-named": "a parameter byte without a name now has one, and must be given without a default",
    "parameter-unnamed": "a parameter byte no longer has a name, and may be left out",
    "field-renamed": "the field has another name; the bytes are the same",
    "field-type": "the same bytes were text and are now bytes, or the reverse",
    "field-quantity": "the quantity of the field was added, removed or renamed; the scale is the same",
    "field-target": "the travel limits now apply to the field, or no longer apply",
    "field-enumeration": "the enumeration that names the values of the field was added, removed or exchanged",
    "field-flags": "the table that names the bits of the field was added, removed or exchanged",
    "field-enumeration-by-unit": "on some units, the names for the values come from another enumeration",
    "field-flags-by-unit": "on some units, the names for the bits come from another table",
    "field-open": "device classes now refuse unlisted values or bits of the field, or accept them again",
    "enumeration-added": "a new enumeration",
    "enumeration-removed": "the enumeration was removed",
    "enumeration-renamed": "the enumeration has another name; its values are the same",
    "enumeration-open": "device classes now refuse unlisted values of the enumeration, or accept them again",
    "value-added": "a new name for a value that was kept as a number",
    "value-removed": "the value no longer has a name and is kept as a number",
    "value-modifier": "device classes now combine the value with others, or no longer do",
    "value-renamed": "the value has another name; the number is the same",
    "flags-added": "a new flag table",
    "flags-removed": "the flag table was removed",
    "flags-renamed": "the flag table has another name; its bits are the same",
    "flags-open": "device classes now refuse unlisted bits of the table, or accept them again",
    "bit-added": "a new name for a bit",
    "bit-removed": "the bit no longer has a name; its value is kept",
    "bit-motion": "other bits indicate motion",
    "hindrance": "another state is reported as the reason why nothing moves",
    "motion-target": "the target of a motion is determined in another way",
    "unit-state": "device classes send other messages to switch the outputs of the unit off",
    "motion-need": "another state of the controller is required for a motion",
    "fault-report": "another message is a fault report, or its contents are read differently",
    "effect": "programs that ask for confirmation before a motion or another hazard ask for other messages",
    "bit-renamed": "the bit has another name; its number is the same",
    "quantity-added": "a new quantity",
    "quantity-removed": "the quantity was removed; its fields are reported separately",
    "quantity-renamed": "the quantity has another name; unit and scale are the same",
    "scale-added": "conversions that were refused now work",
    "setting-added": "a new setting for scales",
    "setting-removed": "the fields that give the setting are no longer known",
    "scale-form": "the scale is written with another key or as its inverse; its value is the same",
    "scale-refusal": "a reason why the scale is unknown was added or removed",
    "stage-added": "a new stage",
    "stage-removed": "the stage was removed",
    "stage-renamed": "the stage has another name; its scales are the same",
    "stage-catalogue": "the stage has other names in the catalogue of the vendor, or is another axis",
    "stage-defaults": "apply_stage_defaults() writes other values",
    "stage-limit": "device classes enforce another limit of the stage, or no limit",
    "stage-id": "device classes detect the stage by another number, or no longer",
    "controller-added": "a new group of units with the same scales",
    "controller-removed": "the group of units was removed; the scales are reported with the stages",
    "controller-renamed": "the group has another name; its units are the same",
    "controller-unit-added": "conversions now work with the name of this unit",
    "unit-added": "a new unit",
    "unit-removed": "the unit was removed",
    "unit-messages": "the unit has the messages of another list or family",
    "unit-stages": "the unit supports other stages",
    "unit-pause": "clients make another pause after messages without a reply",
    "unit-also-at": "the units also answer to other addresses",
    "family-added": "a new family of units",
    "family-removed": "the family of units was removed",
    "list-added": "a new list of messages",
    "list-removed": "the list of messages was removed",
    "list-messages": "the units of this list or family have other messages",
    "alias-added": "a new alias, for a unit that is newer than the document",
    "alias-removed": "the alias for a unit that is newer than the document was removed",
    "unit-model": "other reported models identify the unit",
    "unsupported-added": "a unit is now recognised and refused with the reason",
    "unsupported-removed": "the unit is no longer recognised, or is supported",
    "prefix-added": "serial numbers with this prefix are now recognised",
    "prefix-shared": "the prefix is now shared with other units, or no longer; the reported model decides",
    "prefix-removed": "serial numbers with this prefix are no longer recognised",
}
_DOC = {
    "text": "another text",
    "page": "another page",
    "order": "the same entries in another order",
    "document": "another document, or other facts about it",
    "name-prefix": "the prefix of names in the document, which the registry drops",
    "format": "the table of formats; fields with different bytes are reported separately",
    "context": "a context or its values; affected layouts are reported separately",
    "chapter-added": "a new chapter without messages",
    "chapter-removed": "a chapter without messages was removed",
    "chapter-renamed": "a chapter without messages has another name",
    "parameter-zero": "a parameter byte without a name is now documented as zero, or no longer",
    "field-format-name": "the format has another name; size, sign and kind are the same",
    "field-default": "the default in the document",
    "flags-format": "the format in the flag table; fields are reported separately",
    "limit-note": "the source of the limit, or why it is unknown",
    "scale-note": "the printed form or source of the scale, or why it is unknown",
    "keyboard": "the keys to type for a byte",
    "value-reserved": "whether the document reserves the value for future use",
    "firmware": "notes on firmware versions",
    "hardware-type": "the meaning of a hardware type",
    "erratum-added": "a new erratum",
    "erratum-removed": "the erratum was removed",
    "erratum-renamed": "the erratum has another slug",
    "erratum": "the contents of the erratum",
    "rule-added": "a new rule from the document",
    "rule-removed": "the rule was removed",
    "rule-renamed": "the rule has another slug",
    "rule": "the text, strength or subject of the rule",
    "example-added": "a new worked example or capture",
    "example-removed": "the worked example or capture was removed",
    "example": "the contents of the worked example or capture",
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
"""Slug -> kind, gravest class first."""


SCHEMA_VERSION = 1


def counts(changes: Sequence[Change]) -> dict[ChangeClass, int]:
    """Return the number of changes in each class, gravest class first."""
    levels = [change.level for change in changes]
    return {level: levels.count(level) for level in sorted(ChangeClass, reverse=True)}


def report(old: str, new: str, changes: Sequence[Change]) -> Json:
    """Return the changes as plain data.

    :param old: the old side, as the user named it.
    :param new: the new side, as the user named it.
    """
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
