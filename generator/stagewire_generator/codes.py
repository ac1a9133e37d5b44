"""The table of diagnostics: for each code its title, what brings it, and the cure.

Messages, ``stagewire check --explain`` and ``docs/diagnostics.md`` are made from it. Codes are stable: one
that is no longer needed is not given to something else.
"""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True, slots=True)
class Code:
    """What a diagnostic code stands for.

    :param title: what is wrong, without a capital and a full stop.
    :param cause: what typically brings it, in a sentence or two.
    :param hint: the cure, without a capital and a full stop; a diagnostic may bring a closer one.
    """

    title: str
    cause: str
    hint: str

    def __post_init__(self) -> None:
        """Raise ``ValueError`` for an empty text, so that no code goes without an explanation."""
        for field in fields(self):
            if not getattr(self, field.name).strip():
                raise ValueError(f"a diagnostic code without a {field.name}")


@dataclass(frozen=True, slots=True)
class Group:
    """Codes that belong together, and a paragraph on all of them."""

    title: str
    introduction: str
    codes: dict[str, Code]


GROUPS: tuple[Group, ...] = (
    Group(
        "Files",
        "Reading a file. Only text, decimal and `0x` integers, `true`, `false` and `null` exist; "
        "whatever else YAML readers read by turns as a number, a date, a yes or a text is put in quotes. "
        "A protocol with errors of this group, or of the schema, is not looked at any further, because "
        "half a registry would only bring errors that are none.",
        {
            "SW001": Code(
                "not readable YAML",
                "A bracket or quote that is never closed, a tab in the indentation, a colon within a plain "
                "text; or a file that is empty, or holds two documents.",
                "mend the syntax at the place that is named",
            ),
            "SW002": Code(
                "duplicate key",
                "An entry was copied and its key left as it was. Most YAML readers drop the first of the "
                "two without a word.",
                "keep one of the two entries",
            ),
            "SW003": Code(
                "anchors, aliases, merge keys and tags are not used",
                "A fact is shared with `&`, `*` or `<<`, or its type forced with `!`. What stands in one "
                "place would then mean something in another.",
                "write the fact out",
            ),
            "SW004": Code(
                "a plain word that YAML readers take for different things",
                "A number such as `010`, `1.5` or `1:30`, a date, or a word such as `on` and `no` stands "
                "without quotes.",
                "put it in quotes",
            ),
            "SW005": Code(
                "a key that is not text",
                "A number, `true` or a list stands in front of a colon; often a name that looks like a "
                "number.",
                "write a name, or put it in quotes",
            ),
            "SW006": Code(
                "a file is missing or not UTF-8 text",
                "The folder is not the one that holds the protocols, a file was not committed, or an "
                "editor saved it in an older encoding.",
                "add the file, or save it as UTF-8",
            ),
            "SW007": Code(
                "a control or invisible character in a text",
                "A text was pasted from a PDF or a web page, and brought a character that no editor shows.",
                "remove the character",
            ),
            "SW008": Code(
                "a file that is not read: a link out of the spec, too large, no regular file, or elsewhere",
                "A symbolic link leads out of the spec, or a folder or a large file has a name that ends "
                "in `.yaml`; or a file stands beside the folder of its kind, or is called `.yml`.",
                "put a text file of at most 1 MiB there",
            ),
        },
    ),
    Group(
        "Schema",
        "Each kind of file has a JSON Schema in `spec/schema/`; editors that know `yaml-language-server` "
        "show the same errors while you type.",
        {
            "SW010": Code(
                "not as the schema says",
                "A key is misspelt, missing or in the wrong place, or a value is of another type or form "
                "than this kind of file has there.",
                "see the schema that the first line of the file names",
            ),
        },
    ),
    Group(
        "Names and references",
        "A name is unique in its protocol, and still unique when a language folds case or drops "
        "underscores.",
        {
            "SW020": Code(
                "the same name twice",
                "Two files define one name, or a parameter set opens into a message that is written out, "
                "too.",
                "names are unique in a protocol; rename or remove one",
            ),
            "SW021": Code(
                "a name that nothing defines",
                "A spelling mistake in a reference, or a thing that was renamed where it is defined only.",
                "correct the spelling, or define it",
            ),
            "SW022": Code(
                "names that cannot be told apart in generated code",
                "Two names differ in capitals or underscores alone, or two things of different kinds would "
                "become one class or attribute.",
                "rename one of them",
            ),
            "SW023": Code(
                "a name that a generated language keeps for itself",
                "The name is a keyword, a device name of a file system, or one that generated classes and "
                "modules need themselves.",
                "choose another name",
            ),
            "SW024": Code(
                "a spelling that does not spell the name",
                "A letter was lost where `spelling` splits a run-together name into words, or the "
                "message was renamed and its spelling was not; or the name begins with what no `groups` "
                "list, in protocol.yaml or in overlay.yaml.",
                "the words, joined, must give the name without its group",
            ),
        },
    ),
    Group(
        "Layouts",
        "What stands on the wire.",
        {
            "SW030": Code(
                "two messages with one id",
                "An entry was copied and kept its id, or the document misprints one of the two.",
                "one of the ids is wrong; see the document",
            ),
            "SW031": Code(
                "the length is not the sum of the fields",
                "A field is missing or has a format of another size; or the length counts the header, "
                "too, or is misprinted.",
                "correct the length or the fields",
            ),
            "SW032": Code(
                "layouts that neither bytes nor context tell apart",
                "Two layouts of a message have one length, and nothing says when each of them holds; or a "
                "context is given where the length decides already.",
                "give each a `when`",
            ),
            "SW033": Code(
                "a range or value that the format cannot hold",
                "A limit, default or value is larger than the bytes of the field, or negative without a "
                "sign; or a text has a range or a unit.",
                "correct the range or the format",
            ),
            "SW034": Code(
                "an enumeration or flag value twice",
                "Two names have the same number; a line was copied, or the document has two words for one "
                "thing. Or a modifier has bits in common with another value, or has no value to modify.",
                "each value has one name, and a modifier has bits of its own",
            ),
            "SW035": Code(
                "an exchange that does not fit",
                "What is named as the answer or the end of a message is sent by the host only, so that it "
                "can never come.",
                "a REQ is answered by a message to the host",
            ),
            "SW036": Code(
                "a message without id or layout and without an erratum",
                "The document names a message and does not describe it. That is an error of the "
                "document, and is noted as one.",
                "say so in an erratum",
            ),
            "SW037": Code(
                "a scale that is no exact positive rational, or one of another unit",
                "A factor is zero, or written with a decimal point or a sign; a scale has none or several; "
                "its key names another unit than the quantity; it has no source; or a unit has scales of "
                "two groups.",
                "write it as N or N/D",
            ),
            "SW038": Code(
                "what the framing of the protocol has no place for",
                "A section, a parameter byte or a value is used that frames of this kind cannot carry; "
                "or two parts of the framing contradict each other.",
                "header and packet framing have messages, slots have commands; or correct what is named",
            ),
            "SW039": Code(
                "a page that the document has not",
                "A page number is mistyped, or it is that of another issue of the document.",
                "correct the page, or the number of pages",
            ),
        },
    ),
    Group(
        "Witness and errata",
        "What the document prints is held against the registry, place by place: a difference if and only "
        "if an erratum.",
        {
            "SW040": Code(
                "the document prints something else than the registry says",
                "One of the two was copied wrongly, or the document is wrong and nobody has noted it yet.",
                "look at the page; correct the one that was copied wrongly, or add an erratum with this "
                "place",
            ),
            "SW041": Code(
                "an erratum that no difference and no example bears out",
                "The erratum names no place, and no worked example refers to it; or the example that did "
                "is gone.",
                "name the place of the difference, refer to it from an example, or remove it",
            ),
            "SW042": Code(
                "an erratum names a place where document and registry agree",
                "The registry was corrected after the erratum was written, or the name of the place is "
                "misspelt.",
                "remove the place from the erratum",
            ),
            "SW043": Code(
                "a message that the witness does not have",
                "A message was added to the registry and not to `printed/`, or has another name there.",
                "transcribe what the document prints; where there is none, write `witness: false` in "
                "protocol.yaml",
            ),
            "SW044": Code(
                "the witness has a message that the registry has not",
                "A message was removed or renamed in the registry only, or its chapter is still to be "
                "written.",
                "add it to the registry",
            ),
            "SW045": Code(
                "a place that two errata claim",
                "An erratum was copied with its places, or two people noted the same misprint.",
                "one difference has one erratum",
            ),
            "SW046": Code(
                "a witness of what is not printed",
                "The folder `printed/` has files, and `protocol.yaml` says by `witness: false` that "
                "there is no document to hold the registry against.",
                "remove the file, or the line `witness: false`",
            ),
        },
    ),
    Group(
        "Overlays",
        "A later issue of a document, laid over a protocol; [Overlays](how-to/overlays.md) explains it. The "
        "protocol under each overlay is also checked by all rules above.",
        {
            "SW060": Code(
                "an overlay replaces an entry and does not say so",
                "The name is taken: a new entry got the name of another by accident, or its override was "
                "not listed.",
                "list it under `overrides` in overlay.yaml, or choose another name",
            ),
            "SW061": Code(
                "an override that replaces nothing",
                "The name is misspelt, here or at the entry, or stands under another section; or the "
                "protocol dropped the entry.",
                "correct the name or the section, or remove it from `overrides`",
            ),
            "SW062": Code(
                "an overlay that is called otherwise than its folder",
                "The folder was copied or renamed. `--overlay` finds an overlay by its folder, and what is "
                "generated names it as overlay.yaml does.",
                "rename one of the two",
            ),
        },
    ),
    Group(
        "Effects",
        "What may be sent without asking has to be known of every message. So nothing has an effect by "
        "omission, but for a SET, which sets what stays, and a REQ, which asks.",
        {
            "SW070": Code(
                "a message without an effect, or with one where none can be",
                "A message to the controller was added and its effect was not; or `effect` stands at one "
                "that the controller sends, or at a parameter set without a SET.",
                "decide by the document: `effect: motion` for whatever moves, opens, or is put out "
                "otherwise; `none` for what only asks; docs/reference/registry.md has all of them",
            ),
            "SW071": Code(
                "an effect that contradicts what halts what",
                "Of two messages one halts the other by `halted_by`, and the effect of the first is not "
                "`stop`, or that of the second not `motion`.",
                "correct the effect, or `halted_by`",
            ),
        },
    ),
    Group(
        "Changes",
        "`stagewire check --against` compares the spec with an earlier one. What changes bytes must say, "
        "in the same change, the evidence for it; [Changes](reference/changes.md) says exactly what counts.",
        {
            "SW050": Code(
                "a change on the wire that nothing in the same change vouches for",
                "A length, id, range or scale was edited, and neither an erratum nor a reference to the "
                "document came with it.",
                "add the page, witness or worked example that shows it, or an erratum that names it",
            ),
            "SW051": Code(
                "something on the wire was removed, and nothing in the same change says why",
                "A message is gone, so that it has no page, witness or example left that could vouch for "
                "its end.",
                "name it in the subject of a new erratum, or state the new issue of the document",
            ),
        },
    ),
)
"""The codes by what they are about, in the order of the documentation."""

CODES: dict[str, Code] = {name: code for group in GROUPS for name, code in group.codes.items()}
"""Code -> what it stands for."""
