"""The kind of change for each attribute of the model.

Every attribute has one of four entries: the kind of its change; a table for plain data; ``Elsewhere``, if the
result depends on more than its two values; or ``Ignored``, with the reason. Tests compare the tables with the
dataclasses of the model and the JSON Schemas of the plain data, so that no attribute is forgotten.
"""

from __future__ import annotations

from stagewire_generator import model, model_fields, model_scales
from stagewire_generator.change.entries import (
    Attribute,
    Data,
    Elsewhere,
    Entries,
    Ignored,
    Names,
    Sequence,
)
from stagewire_generator.framing import FRAMINGS, Rules, rules_of

_PAIRED = Elsewhere("pairing")
_PLACE = Ignored("the position in the files")
_IN_FIELDS = Elsewhere("fields")
_FROM_ERRATA = Ignored("follows from the errata, which name their messages and fields")
_OVERLAY = "document"  # the document of the overlay, or of the protocol itself

_DOCUMENT = Data(dict.fromkeys(("title", "issue", "date", "pages", "sections"), "document"))
_FORMATS = Data(
    {
        "*": Entries("format", "format", "format"),
        **dict.fromkeys(("*/size", "*/signed", "*/real"), "format"),
        "*/page": "page",
        "*/note": "text",
    }
)


def _framing(rules: Rules) -> dict[str, str | Names | Sequence | Entries]:
    """Return the entries for the keys of one framing."""
    return {
        **dict.fromkeys(rules.keys, "framing"),
        **{key: Sequence("framing") for key in rules.lists},
        **{f"{key}/format": "format" for key in rules.formats},  # its size is compared separately
        **{f"{key}/size": "framing" for key in rules.formats},
        **{key: Names("framing", "enumeration") for key in rules.enumerations},
    }


_FRAMING = Data(
    {
        "kind": "framing",
        "page": "page",
        **{key: entry for kind in FRAMINGS for key, entry in _framing(rules_of(kind)).items()},
    }
)
_CONTEXTS = Data(
    {
        "*": Entries("context", "context", "context"),
        "*/values": "context",
        "*/page": "page",
        "*/summary": "text",
        "*/unstated": "text",
    }
)
_NEEDED = ("usable", "unhindered", "ignored/fields", "ignored/with", "each_time")
_EXCHANGE = Data(
    {
        "answered_by": Names("exchange", "message"),
        "completes_with": Names("exchange", "message"),
        "stops_with": Names("exchange", "message"),
        "muted_by": Names("exchange", "message"),
        "announces": Names("exchange", "message"),
        "starts": Names("exchange", "message"),
        "stops": Names("exchange", "message"),
        "periodic_ms": "exchange",
        "unsolicited": "exchange",
        **dict.fromkeys(("keeps_alive", "counts_for_keep_alive"), "exchange"),
        "reports_status": "exchange",
        "halted_by": Names("exchange", "message"),
        "stored/read": Names("exchange", "message"),
        "stored/field": "exchange",
        **{f"stored/when/{key}": "motion-target" for key in ("field", "value")},
        "requires/*": Entries("message", "motion-need", "motion-need"),
        **{f"requires/*/{key}": "motion-need" for key in _NEEDED},
        **{f"reports_fault/{key}": "fault-report" for key in ("request", "code", "text")},
        "reports_fault/source": "text",
        "ends_when/read": Names("exchange", "message"),
        **{f"ends_when/{key}": "exchange" for key in ("field", "value")},
    }
)
_TIME = ("set", "field", "counts", "factor", "exponent")
_WITH_SOURCE = ("units/*/hardware_type", "units/*/sends/*", "units/*/also_at", "units/*/baud_rates",
                "families/*/reports_stage", "families/*/also_at", "families/*/pause",
                "families/*/positions", "families/*/classes/enabling",
                *map("units/*/{}".format, model.STATES))  # fmt: skip
_ALSO_AT = ("addresses", "preferred")
_POSITIONS = ("move", "argument", "values", "read", "bits", *map("time/{}".format, _TIME))
_ENABLING = ("set", "field", "disables_others", "before_motions")
_HINDERS = Data({"cause": "hindrance", "when": "hindrance", "limit": "hindrance"})
_CALL = Data(
    {
        "name": "call",
        "reading": "call",
        **dict.fromkeys(("attribute/name", "attribute/value"), "call"),
        "also/*": Entries("method", "call", "call"),
        "presets/*": Entries("method", "call", "call"),
        "presets/*/summary": "text",
        "presets/*/confirmed": "text",
        **{
            f"presets/*/{key}/*": Entries("field", "call-default", "call-default")
            for key in ("values", "otherwise")
        },
        "defaults/*": Entries("field", "call-default", "call-default"),
    }
)
_SETTING_FACTS = ("unit", "quantity", "told_by/*/field", "told_by/*/while/field")
_SETTINGS = Data(
    {
        "*": Entries("setting", "setting-added", "setting-removed"),
        "*/overlay": _OVERLAY,
        **{f"*/{fact}": kind for fact, kind in (("page", "page"), ("summary", "text"))},
        **{f"*/{fact}": "setting" for fact in _SETTING_FACTS},
        **{f"*/told_by/*/{key}": Sequence("setting") for key in ("while/values", "not_on")},
        "*/told_by/*": Entries("set", "setting", "setting"),
        "*/told_by/*/values/*": Entries("value", "setting", "setting"),
    }
)
_UNITS = Data(
    {
        "units/*": Entries("unit", "unit-added", "unit-removed"),
        "units/*/overlay": _OVERLAY,
        **dict.fromkeys(("units/*/title", "units/*/note"), "text"),
        "units/*/page": "page",
        **{f"{entry}/source": "text" for entry in _WITH_SOURCE},
        "units/*/usb_prefix": "unit-prefix",
        "units/*/card_usb_prefix": "unit-prefix",
        "units/*/hardware_type/value": "hardware-type",
        "units/*/sends/*": Entries("message", "unit-messages", "unit-messages"),
        "units/*/sends/*/form": "unit-messages",
        "units/*/reported_as/*": Entries("model", "unit-model", "unit-model"),
        "units/*/address": "unit-address",
        **{f"units/*/{key}": "unit-channels" for key in ("channels", "channel_idents", "bays")},
        **{f"units/*/{key}": "unit-messages" for key in ("family", "list", "more_lists")},
        "units/*/status": "unit-status",
        "units/*/contexts/*": Sequence("unit-context"),
        "units/*/stages": Names("unit-stages", "stage"),
        "units/*/fewer_stages": "text",
        "units/*/built_in": Names("unit-stages", "stage"),
        "units/*/reports_ends_after": Names("motion-need", "message"),
        "units/*/serial_digits": "unit-prefix",
        **{f"units/*/also_at/{key}": "unit-also-at" for key in _ALSO_AT},
        "units/*/update_rate_hz": "unit-rate",
        "units/*/baud_rates/values": "unit-baud-rates",
        **{f"units/*/{key}/messages": Sequence("unit-state") for key in model.STATES},
        "units/*/keep_alive": Names("unit-keep-alive", "message"),
        "families/*": Entries("family", "family-added", "family-removed"),
        "families/*/overlay": _OVERLAY,
        **dict.fromkeys(("families/*/title", "families/*/note"), "text"),
        "families/*/messages": Names("list-messages", "message"),
        "families/*/like": "list-messages",
        **{f"families/*/also_at/{key}": "unit-also-at" for key in _ALSO_AT},
        "families/*/reports_stage/field": "stage-id",
        **dict.fromkeys(("families/*/reports_stage/page", "lists/*/page"), "page"),
        **{f"families/*/positions/{key}": "motion-target" for key in _POSITIONS},
        "families/*/hazards/*": Entries("message", "effect", "effect"),
        "families/*/pause/ms": "unit-pause",
        "families/*/classes/channel": "call",
        "families/*/classes/methods/*": Entries("method", "call", "call"),
        "families/*/classes/without/*": Entries("message", "call", "call"),
        **{f"families/*/classes/enabling/{key}": "motion-need" for key in _ENABLING},
        "families/*/classes/enabling/channels/*": Entries("value", "motion-need", "motion-need"),
        "lists/*": Entries("list", "list-added", "list-removed"),
        "lists/*/overlay": _OVERLAY,
        **dict.fromkeys(("lists/*/title", "lists/*/note"), "text"),
        "lists/*/units": "text",  # a change also appears as the `list` of a unit
        "lists/*/messages": Names("list-messages", "message"),
        "lists/*/completes": Names("list-messages", "message"),
        "lists/*/misprinted/*": Entries("message", "text", "text"),
        "lists/*/cannot_stop/*": Entries("message", "text", "text"),
        "addresses/*": Entries("address", "address", "address"),
        "addresses/*/overlay": _OVERLAY,
        "addresses/*/value": "address",
        "addresses/*/first": "address",
        "addresses/*/last": "address",
        "addresses/*/count": "address",
        "addresses/*/page": "page",
        "addresses/*/note": "text",
        "known_prefixes/*": Entries("prefix", "prefix-added", "prefix-removed"),
        "known_prefixes/*/overlay": _OVERLAY,
        "known_prefixes/*/unit": "unit-prefix",
        "known_prefixes/*/shared_with": "prefix-shared",
        "known_prefixes/*/distinguished_by": "prefix-shared",
        "known_prefixes/*/like": "unit-messages",  # the resolver converts it to an alias
        "known_prefixes/*/note": "text",
        "known_prefixes/*/source": "text",
        "aliases/*": Entries("alias", "alias-added", "alias-removed"),
        "aliases/*/overlay": _OVERLAY,
        "aliases/*/title": "text",
        "aliases/*/like": "unit-messages",
        "aliases/*/reported_as/*": Entries("model", "unit-model", "unit-model"),
        "aliases/*/source": "text",
        "unsupported/*": Entries("unsupported unit", "unsupported-added", "unsupported-removed"),
        "unsupported/*/overlay": _OVERLAY,
        "unsupported/*/title": "text",
        "unsupported/*/reason": "text",
        "unsupported/*/prefixes": "unit-prefix",
        "unsupported/*/source": "text",
        "unsupported/*/note": "text",
        "hardware_types/*": Entries("hardware type", "hardware-type", "hardware-type"),
        "hardware_types/*/overlay": _OVERLAY,
        "hardware_types/*/title": "hardware-type",
        "hardware_types/*/page": "page",
        "hardware_types/*/note": "text",
    }
)

SCALE: dict[str, Attribute] = {
    "by": "scale",
    "setting": "scale",
    "setting_unit": "scale",
    "counts_at_setting": "scale",
    "cases": Elsewhere("scales"),
    "units": Elsewhere("scales"),
    "unknown": Elsewhere("scales"),
    "printed": "scale-note",
    "source": "scale-note",
    "page": "scale-note",
}
"""The rule of a scale without a fixed factor."""

ATTRIBUTES: dict[type, dict[str, Attribute]] = {
    model.Protocol: {
        "name": _PAIRED,
        "title": "text",
        "summary": "text",
        "document": _DOCUMENT,
        "firmware": Elsewhere("messages"),
        "package": "package",
        "python_title": "text",
        "version": "text",
        "name_prefix": "name-prefix",
        "formats": _FORMATS,
        "framing": _FRAMING,
        "id_size": Ignored("follows from the framing"),
        "contexts": _CONTEXTS,
        "chapters": Elsewhere("chapters"),
        "messages": Elsewhere("messages"),
        "sets": Elsewhere("sets"),
        "enumerations": Elsewhere("tables"),
        "flags": Elsewhere("tables"),
        "quantities": Elsewhere("scales"),
        "settings": _SETTINGS,
        "controllers": Elsewhere("scales"),
        "stages": Elsewhere("scales"),
        "units": _UNITS,
        "later_messages": Ignored("follows from the lists and families, which are compared"),
        "errata": Elsewhere("proofs"),
        "rules": Elsewhere("proofs"),
        "examples": Elsewhere("proofs"),
        "captures": Elsewhere("proofs"),
        "evidence": Ignored("sources of facts, which are compared"),
        "overlays": Elsewhere("documents"),
    },
    model.Chapter: {
        "name": _PAIRED,
        "title": "text",
        "page": "page",
        "order": "order",
        "summary": "text",
        "overlay": _OVERLAY,
    },
    model.Message: {
        "name": _PAIRED,
        "id": Elsewhere("messages"),
        "chapter": Names("message-module", "chapter"),
        "words": Elsewhere("messages"),
        "pages": "page",
        "direction": "message-direction",
        **dict.fromkeys(("effect", "hazard"), "effect"),
        "summary": "text",
        "note": "text",
        "set": Elsewhere("messages"),
        "exchange": _EXCHANGE,
        "aliases": "message-alias",
        "later_pages": "page",
        "layouts": Elsewhere("layouts"),
        "errata": _FROM_ERRATA,
        "place": _PLACE,
        "kind": "message-kind",
        "title": "text",
        "keyboard": "keyboard",
        "size": "command-size",
        "dummy": "command-dummy",
        "switches_to": "setup-switch",
        "firmware": Elsewhere("messages"),
        "group": Ignored("one of its words, which are compared"),
        "addressee": "addressee",
        "tells": "exchange",
        "call": _CALL,
        "overlay": _OVERLAY,
        "sub_message": "message-sub-message",
        "not_sent": "message-not-sent",
        "without_flag": "message-without-flag",
        "twin_of": Ignored("its name, which is compared, contains that of the other message"),
    },
    model.Firmware: dict.fromkeys(("version", "note", "page"), Elsewhere("messages")),
    model.Layout: {
        "form": _PAIRED,
        "when": Elsewhere("layouts"),
        "param1": Elsewhere("layouts"),
        "param2": Elsewhere("layouts"),
        "length": "layout-length",
        "fields": Elsewhere("layouts"),
        "note": "text",
        "place": _PLACE,
        "only_zero": "layout-only-zero",
        "sent_when": "layout-sent-when",
    },
    model_fields.Field: {
        "name": _PAIRED,
        "offset": "field-offset",
        "format": Elsewhere("fields"),
        "role": "field-role",
        "minimum": Elsewhere("fields"),
        "maximum": Elsewhere("fields"),
        "page": "page",
        "place": _PLACE,
        "ranged": Ignored("the source of the range, which is compared"),
        "open": "field-open",
        "default": "field-default",
        "omitted": "parameter-omitted",
        "constant": "field-constant",
        "selects": Ignored("follows from the sub-message of its message, which is compared"),
        "target": "field-target",
        "quantity": Elsewhere("fields"),
        "enum": Names("field-enumeration", "enumeration"),
        "flags": Names("field-flags", "flags"),
        "flags_by_unit": Elsewhere("fields"),
        "enums_by_unit": Elsewhere("fields"),
        "note": "text",
        "errata": _FROM_ERRATA,
        "overlay": Ignored("follows from its message, or from its block of fields"),
        "array": Elsewhere("fields"),
        "ranges_by_unit": Elsewhere("fields"),
        "other_range": Ignored("the range of the other units, which is compared as the range"),
    },
    model_fields.Array: dict.fromkeys(("item", "rows", "columns"), _IN_FIELDS),
    model_fields.Column: dict.fromkeys(("name", "each", "quantity", "note"), _IN_FIELDS),
    model_fields.Format: dict.fromkeys(("name", "size", "signed", "kind", "real"), _IN_FIELDS),
    model.ParameterSet: {
        "name": _PAIRED,
        "words": Ignored("its messages have the same words and more"),
        "members": Elsewhere("sets"),
        "place": _PLACE,
    },
    model_fields.Enumeration: {
        "name": _PAIRED,
        "page": "page",
        "summary": "text",
        "values": Elsewhere("tables"),
        "place": _PLACE,
        "overlay": _OVERLAY,
        "open": Elsewhere("tables"),
    },
    model_fields.EnumValue: {
        "name": _PAIRED,
        "value": "value-number",
        "note": "text",
        "keyboard": "keyboard",
        "reserved": "value-reserved",
        "modifier": "value-modifier",
        "hinders": _HINDERS,
        "symbol": "text",
    },
    model_fields.FlagTable: {
        "name": _PAIRED,
        "page": "page",
        "summary": "text",
        "format": "flags-format",
        "bits": Elsewhere("tables"),
        "place": _PLACE,
        "overlay": _OVERLAY,
        "open": Elsewhere("tables"),
    },
    model_fields.FlagBit: {
        "name": _PAIRED,
        "bit": "bit-number",
        "note": "text",
        "motion": "bit-motion",
        "hinders": _HINDERS,
        "symbol": "text",
    },
    model_scales.Quantity: {
        "name": _PAIRED,
        "unit": "quantity-unit",
        "page": "page",
        "summary": "text",
        "factor": Elsewhere("scales"),
        "rule": Elsewhere("scales"),
        "place": _PLACE,
        "overlay": _OVERLAY,
        "rotary_unit": "quantity-unit",
    },
    model_scales.Factor: {
        "key": Elsewhere("scales"),
        "value": Elsewhere("scales"),
        **dict.fromkeys(("printed", "source", "page", "note"), "scale-note"),
        "overlay": _OVERLAY,
    },
    model_scales.Conflict: {"factors": Elsewhere("scales")},
    model_scales.Controller: {
        "name": _PAIRED,
        "units": Elsewhere("scales"),
        "place": _PLACE,
        "overlay": _OVERLAY,
        "aliases": Elsewhere("scales"),
        "page": "page",
    },
    model_scales.Stage: {
        "name": _PAIRED,
        **dict.fromkeys(("title", "defaults_source", "defaults_note"), "text"),
        "defaults": "stage-defaults",
        "page": "page",
        "scales": Elsewhere("scales"),
        "place": _PLACE,
        "overlay": _OVERLAY,
        "limits": Elsewhere("scales"),
        **dict.fromkeys(("catalogue", "axis"), "stage-catalogue"),
        "rotary": "quantity-unit",
        "ids": Elsewhere("scales"),
    },
    model_scales.StageId: {"id": "stage-id", "source": "text", "page": "page", "overlay": _OVERLAY},
    model_scales.Limit: {
        "value": "stage-limit",
        "unit": "stage-limit",
        **dict.fromkeys(("source", "page", "note"), "limit-note"),
        "overlay": _OVERLAY,
    },
    model.Erratum: {
        "id": _PAIRED,
        "pages": "erratum",
        "subject": "erratum",
        "messages": Names("erratum", "message"),
        "fields": Names("erratum", "message"),
        "printed": "erratum",
        "encoded": "erratum",
        "evidence": "erratum",
        "kind": "erratum",
        "origin": "erratum",
        "places": "erratum",
        "not_compared": "erratum",
        "place": _PLACE,
        "overlay": _OVERLAY,
    },
    model.Rule: {
        "id": _PAIRED,
        "page": "page",
        "also": "page",
        "strength": "rule",
        "subject": "rule",
        "states": "rule",
        "means": "text",
        "messages": Names("rule", "message"),
        "errata": "rule",
        "waiver": "rule",
        "sentences": "page",
        "place": _PLACE,
        "overlay": _OVERLAY,
    },
    model.Overlay: {
        "name": _PAIRED,
        "title": "document",
        "summary": "document",
        "document": _DOCUMENT,
        "place": _PLACE,
        "default": "overlay-default",
    },
}
