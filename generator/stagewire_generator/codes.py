"""The table of diagnostics: the title, the cause and the hint of each code.

Messages, ``stagewire check --explain`` and ``docs/diagnostics.md`` are made from this table. Codes are
stable: a retired code is never reused.
"""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True, slots=True)
class Code:
    """The meaning of a diagnostic code.

    :param title: what is wrong, without a capital or a full stop.
    :param cause: the typical cause, in a sentence or two.
    :param hint: what to do, without a capital or a full stop; a diagnostic may give a more specific hint.
    """

    title: str
    cause: str
    hint: str

    def __post_init__(self) -> None:
        """Raise ``ValueError`` for an empty text, so that every code is explained."""
        for field in fields(self):
            if not getattr(self, field.name).strip():
                raise ValueError(f"a diagnostic code without a {field.name}")


@dataclass(frozen=True, slots=True)
class Group:
    """Codes that belong together, with an introduction."""

    title: str
    introduction: str
    codes: dict[str, Code]


GROUPS: tuple[Group, ...] = (
    Group(
        "Files",
        "Errors in reading a file. A value is a text, a decimal or `0x` integer, `true`, `false` or `null`. "
        "Quote everything else: some YAML readers read it as a number, a date or a yes/no, others as text. "
        "A protocol with an error of this group or of the schema is not checked further, because a "
        "partly read registry would only produce spurious errors.",
        {
            "SW001": Code(
                "invalid YAML",
                "A bracket or quote is not closed, a tab is used for indentation, or an unquoted text "
                "contains a colon. Or the file is empty or holds two documents.",
                "correct the syntax at the given position",
            ),
            "SW002": Code(
                "duplicate key",
                "An entry was copied without changing its key. Most YAML readers silently drop the first "
                "of the two.",
                "keep one of the two entries",
            ),
            "SW003": Code(
                "anchors, aliases, merge keys and tags are not supported",
                "A value is shared with `&`, `*` or `<<`, or its type is forced with `!`. The meaning of "
                "an entry would then depend on another part of the file.",
                "write the value out in full",
            ),
            "SW004": Code(
                "an unquoted value that YAML readers interpret differently",
                "A number such as `010`, `1.5` or `1:30`, a date, or a word such as `on` or `no` is not "
                "quoted.",
                "put it in quotes",
            ),
            "SW005": Code(
                "a key that is not text",
                "The key is a number, `true` or a list. Often it is a name that looks like a number.",
                "use a name, or quote the key",
            ),
            "SW006": Code(
                "a file that is missing or is not UTF-8 text",
                "The directory is not the one that holds the protocols, a file was not committed, or an "
                "editor saved it in an older encoding.",
                "add the file, or save it as UTF-8",
            ),
            "SW007": Code(
                "a control character or invisible character in a text",
                "Text pasted from a PDF or a web page often contains characters that editors do not show.",
                "remove the character",
            ),
            "SW008": Code(
                "a file that cannot be used: a link out of the spec, too large, not a regular file, or in "
                "the wrong directory",
                "A symbolic link leads out of the spec. Or a directory, or a file of more than 1 MiB, has a "
                "name that ends in `.yaml`. Or a file is not in the directory for its kind, or its name "
                "ends in `.yml`.",
                "use a regular text file of at most 1 MiB, in the directory for its kind",
            ),
        },
    ),
    Group(
        "Schema",
        "Each kind of file has a JSON Schema in `spec/schema/`. Editors that support "
        "`yaml-language-server` show the same errors while you type.",
        {
            "SW010": Code(
                "a value or key that does not match the schema",
                "A key is misspelt, missing or in the wrong place, or a value has the wrong type or form "
                "for this kind of file.",
                "see the schema of this kind of file; `stagewire schemas DIR` writes all schemas to DIR",
            ),
        },
    ),
    Group(
        "Names and references",
        "A name must be unique in its protocol, even when case and underscores are ignored, as some "
        "languages do.",
        {
            "SW020": Code(
                "a name that is defined twice",
                "Two files define the same name, or a parameter set generates a message that is also "
                "written out.",
                "rename or remove one of them: names are unique in a protocol",
            ),
            "SW021": Code(
                "an undefined name",
                "A reference is misspelt, or its target was renamed and the reference was not.",
                "correct the spelling, or define the name",
            ),
            "SW022": Code(
                "names that clash in generated code",
                "Two names differ only in case or underscores, or two things of different kinds would "
                "become the same class or attribute.",
                "rename one of them",
            ),
            "SW023": Code(
                "a name that is reserved in generated code",
                "The name is a keyword of a generated language, a device name of a file system, or a name "
                "that generated classes and modules use themselves.",
                "choose another name",
            ),
            "SW024": Code(
                "a spelling that does not match the name",
                "A letter is missing where `spelling` splits a name into words, or the message was renamed "
                "and its `spelling` was not. Or the name begins with a group that no `groups` list "
                "contains, neither in protocol.yaml nor in overlay.yaml.",
                "make the words, when joined, equal the name without its group",
            ),
        },
    ),
    Group(
        "Layouts",
        "Errors in the layout of bytes on the wire.",
        {
            "SW030": Code(
                "two messages with the same id",
                "An entry was copied and kept its id, or the document misprints one of the two.",
                "one of the ids is wrong: compare both with the document",
            ),
            "SW031": Code(
                "the length is not the total size of the fields",
                "A field is missing or has a format of the wrong size. Or the length includes the header, "
                "or is misprinted.",
                "correct the length or the fields",
            ),
            "SW032": Code(
                "layouts that cannot be distinguished",
                "Two layouts of a message have the same length, and nothing states when each of them "
                "applies. Or a layout has a `when` although its length already identifies it.",
                "give each layout a `when`",
            ),
            "SW033": Code(
                "a range or value that does not fit the format",
                "A limit, default or value needs more bytes than the field has, or is negative in an "
                "unsigned format. Or a text field has a range or a unit. Or the range in a case of a "
                "scale is not within that of the field.",
                "correct the range or the format",
            ),
            "SW034": Code(
                "an enumeration value or flag bit that is defined twice",
                "Two names have the same number: a line was copied, or the document uses two words for the "
                "same thing. Or a modifier shares bits with another value, or has no value to modify.",
                "give each value one name, and each modifier bits that no other value uses",
            ),
            "SW035": Code(
                "an exchange that cannot take place",
                "The message named as a reply, or as the end of an action, is only sent by the host, so it "
                "never arrives. Or a host cannot send the message that should halt a motion.",
                "name a message from the controller as reply or end, and one from the host in `halted_by`",
            ),
            "SW036": Code(
                "a message without an id or layout, and without an erratum",
                "The document names a message but does not describe it. That is an error in the document, "
                "and must be recorded as an erratum.",
                "add an erratum that names the message",
            ),
            "SW037": Code(
                "a scale that is not an exact positive rational, or is in the wrong unit",
                "A factor is zero, or is written with a decimal point or a sign. Or a scale has no factor "
                "or several, its key names a different unit than the quantity, or it has no source. Or a "
                "unit has scales in two groups, a rotary stage has scales or limits in mm, or the figures "
                "of a `conflict` agree.",
                "write the factor as N or N/D",
            ),
            "SW038": Code(
                "something that the framing of the protocol does not support",
                "The spec uses a section, a parameter byte or a value that frames of this kind cannot "
                "carry. Or two parts of the framing contradict each other.",
                "use `messages` with header and packet framing, and `commands` with slots; otherwise "
                "correct the named part",
            ),
            "SW039": Code(
                "a page that does not exist in the document",
                "A page number is mistyped, or belongs to another issue of the document.",
                "correct the page, or the number of pages",
            ),
        },
    ),
    Group(
        "Sub-messages and contexts",
        "Several messages may share an id if each has a sub-message, which the bytes contain. Layouts of one "
        "length are selected by contexts, which a unit may state. See [the language of the "
        "registry](reference/registry.md#sub-messages).",
        {
            "SW090": Code(
                "a sub-message that does not select its message",
                "Only some messages of an id have a sub-message, or they differ in direction. Or a layout "
                "does not begin with the sub-message, so the bytes would not show which message it is.",
                "give every message of the id a `sub_message`, and begin each layout with its value",
            ),
            "SW091": Code(
                "two values of a context for the same firmware",
                "A context of a unit has two values without `from_firmware`, or two from the same version "
                "on, so the version does not decide between them.",
                "keep one value for each version",
            ),
            "SW092": Code(
                "a context that no unit states, or one that is `unstated` although a unit states it",
                "`protocol.yaml` or an overlay defines a context, and `units.yaml` describes units, but none "
                "of them has a value for it. Device classes then never choose a layout by it.",
                "state it under `contexts` of a unit, remove it, or give the reason in `unstated`",
            ),
            "SW094": Code(
                "an array whose length the packet does not show",
                "An `array` names a field that is not an unsigned integer before it, other fields or other "
                "layouts follow it, or its fields allow more bytes than a header can state.",
                "end the only packet of the message with the array, and let its `rows` and `for_each` name "
                "fields before it; docs/reference/registry.md describes arrays",
            ),
            "SW095": Code(
                "a form of a SET that no context, or more than one form, is sent in",
                "A `sent_when` names a context that does not exist, belongs to a message that no device "
                "class sends in several lengths, or holds together with that of another form.",
                "correct the contexts of `sent_when`; docs/reference/registry.md describes it",
            ),
        },
    ),
    Group(
        "Witness and errata",
        "The witness, the transcription of the printed document in `printed/`, is compared with the "
        "registry place by place. Every difference needs an erratum, and every erratum needs a "
        "difference or a worked example.",
        {
            "SW040": Code(
                "a difference between document and registry without an erratum",
                "One of the two was copied incorrectly, or the document is wrong and no erratum records it "
                "yet.",
                "look at the page, then correct the wrong copy, or add an erratum with this place and both "
                "texts",
            ),
            "SW041": Code(
                "an erratum that no difference and no example supports",
                "The erratum names no place, and no worked example refers to it. Perhaps the example that "
                "did was removed.",
                "name the place of the difference, refer to the erratum from an example, or remove "
                "the erratum",
            ),
            "SW042": Code(
                "an erratum for a place where document and registry agree",
                "The registry was corrected after the erratum was written, or the name of the place is "
                "misspelt.",
                "remove the place from the erratum",
            ),
            "SW043": Code(
                "a message or fact without a second witness",
                "A message or another fact was added to the registry only, or has another name in "
                "`printed/`. Or the document does not describe it, and it is known from another source. "
                "Facts other than messages are only checked with `witness: complete` in `protocol.yaml`.",
                "transcribe what the document prints, as a statement if it is a sentence; decide a fact that "
                "the document leaves open, in decisions.yaml; add a message of a later issue in an overlay "
                "(docs/how-to/overlays.md)",
            ),
            "SW044": Code(
                "a message of the witness that is not in the registry",
                "A message was removed or renamed only in the registry, or its chapter has not been "
                "written yet.",
                "add it to the registry",
            ),
            "SW045": Code(
                "a place that two errata claim",
                "An erratum was copied with its places, or two people recorded the same misprint.",
                "keep one erratum for each difference",
            ),
            "SW046": Code(
                "a witness in a protocol that declares `witness: false`",
                "`protocol.yaml` declares that the document is not transcribed, but the directory "
                "`printed/` contains files.",
                "remove the file, or the line `witness: false`",
            ),
            "SW047": Code(
                "an erratum that states another difference",
                "An erratum states for each place what is printed and what is encoded. Registry or witness "
                "was changed after it was written, or it was copied incorrectly.",
                "look at the page, then correct registry, witness or erratum",
            ),
            "SW048": Code(
                "a registry that contradicts a decision",
                "`decisions.yaml` states the facts that the document leaves open, with the reasons. One of "
                "the two files was changed without the other.",
                "correct the registry, or the decision and its reason",
            ),
            "SW049": Code(
                "a statement, decision or evidence that matches nothing",
                "The path under `states` or `facts` is misspelt, or the entry that it names was renamed or "
                "removed.",
                "correct the path: the keys from the top of the file, separated by /",
            ),
            "SW093": Code(
                "a source of evidence that nothing uses",
                "`evidence.yaml` lists a source, but no evidence names it, and no scale or limit of a stage "
                "has its `cited_as` in its `source`.",
                "remove the source, or correct `cited_as`",
            ),
        },
    ),
    Group(
        "Overlays",
        "An overlay adds a later issue of a document to a protocol; see [Overlays](how-to/overlays.md). "
        "The protocol with each overlay applied is also checked by all the rules above.",
        {
            "SW060": Code(
                "an overlay replaces an entry without declaring it",
                "A new entry accidentally has the name of an existing one, or an intended replacement is "
                "not listed. Or the overlay changes an entry of another one that it does not build on.",
                "choose another name; to replace the entry, list it under `overrides` in overlay.yaml; "
                "to add to it, use additions.yaml",
            ),
            "SW061": Code(
                "an override, addition, withdrawal or renaming of an entry that does not exist",
                "The name is misspelt in overlay.yaml, in additions.yaml or at the entry, or is under the "
                "wrong section. Or the protocol no longer has the entry, or only an overlay has it that this "
                "one does not build on.",
                "correct the name or the section, or remove it",
            ),
            "SW062": Code(
                "an overlay whose name differs from its directory",
                "The directory was copied or renamed. `--overlay` finds an overlay by its directory, while "
                "generated files use the name in overlay.yaml.",
                "rename one of the two",
            ),
            "SW063": Code(
                "an addition that changes or repeats a part of an entry, or would be lost",
                "An entry in additions.yaml gives a key that the entry of the protocol or of the overlay "
                "below already has, or an item that is already in its list. Or the overlay replaces the same "
                "entry.",
                "remove it; to change a value, copy the whole entry and list it under `overrides`",
            ),
            "SW064": Code(
                "an overlay that builds on one that is not applied before it",
                "The name in `builds_on` is misspelt, or two overlays build on each other. Or the other "
                "overlay is left out with --base, is not named, or is named later.",
                "correct the name, or apply the other overlay first",
            ),
        },
    ),
    Group(
        "Effects",
        "Programs need to know which messages are safe to send without asking the user. So every message "
        "to the controller declares its effect. The defaults in a parameter set are `settings` for SET "
        "and `none` for REQ.",
        {
            "SW070": Code(
                "a message without an effect, or with an effect where none is allowed",
                "A message to the controller was added without its effect. Or `effect` is given for a "
                "message that the controller sends, or for a parameter set without a SET.",
                "state the effect that the document describes, such as `motion` for everything that "
                "moves, opens or changes an output, or `none` for a pure request; "
                "docs/reference/registry.md lists all effects",
            ),
            "SW071": Code(
                "an effect that contradicts `halted_by`",
                "A message with `halted_by` must have the effect `motion`, and the message named there "
                "the effect `stop`.",
                "correct the effect, or `halted_by`",
            ),
            "SW072": Code(
                "a hazard of a message that cannot have one",
                "A message that only reads or stops declares a `hazard`, as does a message that the "
                "controller sends, or a parameter set without a SET. Or `hazards` of a family names a "
                "message that is not one of its messages, or that has a hazard of its own.",
                "remove the hazard, or correct the effect or the name",
            ),
        },
    ),
    Group(
        "Units",
        "A unit is described in several places: its entry, its list or family, the addresses, the scales "
        "of stages. These places must agree.",
        {
            "SW080": Code(
                "a list of messages that lacks a reply or a stop",
                "A message was left out of a list or family. A request without its reply cannot be "
                "answered, and a motion without its stop cannot be halted.",
                "add the missing message, or name a motion that nothing halts under `cannot_stop`; "
                "docs/reference/registry.md describes `lists` and `families`",
            ),
            "SW081": Code(
                "a status or keep-alive message that the messages of the unit contradict",
                "The unit has the wrong family or is in the wrong list, or its `status` or `keep_alive` is "
                "wrong. A message with `reports_status` determines the status.",
                "correct the `status` of the unit, or its family or list",
            ),
            "SW082": Code(
                "an address or a count of bays that contradicts the framing",
                "An address is mistyped in units.yaml or in protocol.yaml, or a bay was added in one place "
                "only.",
                "look up the address in the document, then correct `addresses`, the unit, or `framing` in "
                "protocol.yaml",
            ),
            "SW083": Code(
                "a list, family or serial number that belongs to another unit",
                "An entry was copied and kept the name or prefix of the other unit. Or a unit is described, "
                "but still listed as unsupported.",
                "correct the name or the prefix, or remove the unit from `unsupported`",
            ),
            "SW084": Code(
                "stages of a unit that contradict the scales in stages.yaml",
                "A stage was added to a unit without scales for it, or scales without adding the stage to "
                "the unit. Or a unit is in the wrong group of `controllers`, or has a `built_in` stage that "
                "it does not drive. Or the message with its `reports_stage` is not one of its messages, or "
                "two of its stages have the same id there.",
                "correct `stages` of the unit, the group of `controllers`, or the `ids` in stages.yaml",
            ),
            "SW085": Code(
                "a safe state or a stop state that is missing, cannot be sent, or needs a reason",
                "A message of the unit has the hazard `laser` or `heater`, but nothing states how to switch "
                "the output off. Or a message of a state is not one of the unit, a field has no value or one "
                "outside its range, or the unit does not report a field that is to keep its value. Or the "
                "message has an effect other than `stop` or `settings`, such as `motion`, and nothing says "
                "why it is sent.",
                "add a `safe_state`, correct the message, `values` or `kept`, or state the reason in "
                "`because`",
            ),
        },
    ),
    Group(
        "Changes",
        "`stagewire check --against` compares the spec with an earlier one. Every change to bytes needs "
        "evidence in the same change; [Changes](reference/changes.md) describes exactly what counts.",
        {
            "SW050": Code(
                "a change on the wire without evidence in the same change",
                "A length, id, range or scale was edited without adding an erratum or a reference to the "
                "document.",
                "add the page, witness or worked example that shows it, or an erratum that names it",
            ),
            "SW051": Code(
                "a removal on the wire without a reason in the same change",
                "A message was removed, so it has no page, witness or example left that could serve as "
                "evidence.",
                "name it in the subject of a new erratum, or state the new issue of the document",
            ),
        },
    ),
)
"""All codes by topic, in the order of the documentation."""

CODES: dict[str, Code] = {name: code for group in GROUPS for name, code in group.codes.items()}
"""Code -> its meaning."""
