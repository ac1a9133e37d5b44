"""Keep track of a comparison: the compared places and the differences."""

from __future__ import annotations

import difflib
import itertools
import re
from collections.abc import Sequence
from typing import NamedTuple

from stagewire_generator.diagnostics import Place
from stagewire_generator.lint.witness.reading import Vocabulary, pair, same_name, squash
from stagewire_generator.model import Message, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.strict_yaml import Document, KeyPath

NOTHING = "nothing"  # the side that lacks an entry

_PART = re.compile(r"Set|Request|Get")
_PARTS = re.compile(r"(?:Set|Request|Get|/)+")
_VERBS = {"Set": "SET", "Request": "REQ", "Get": "GET"}


class Difference(NamedTuple):
    """One place where document and registry differ."""

    place: str
    at: Place
    printed: str
    encoded: str


class Shared(NamedTuple):
    """The heading that the sub-messages of an id share."""

    id: int
    page: int


class Comparison:
    """The results of a comparison so far, with ``differences`` by place.

    :param document: the file of the witness that is being compared.
    :param vocabulary: the meaning of words in the document, for chapters that use them.
    """

    def __init__(
        self, protocol: Protocol, document: Document, vocabulary: Vocabulary | None = None
    ) -> None:
        self.protocol = protocol
        self.document = document
        self.vocabulary = vocabulary or Vocabulary()
        self.messages = {
            name: message
            for message in protocol.messages
            for name in (message.name, *message.aliases)
        }
        self.by_id = {
            m.id: m for m in protocol.messages if m.id is not None and m.sub_message is None
        }
        self.by_sub_message = {
            (m.id, m.sub_message): m for m in protocol.messages if m.sub_message is not None
        }
        self.shared: dict[str, Shared] = {}  # headings of several messages, by printed name
        self.differences: dict[str, Difference] = {}
        self.not_compared: dict[str, Place] = {}  # places that only people can judge
        self.compared = 0
        self.tables: set[str] = set()  # patterns of facts whose whole table is compared
        self.witnessed: set[str] = set()  # messages that the witness names anywhere
        self.headed: set[str] = set()  # messages that have a heading
        self.unknown: list[tuple[Place, str]] = []  # names of unknown messages
        self.misplaced: list[
            tuple[Place, str]
        ] = []  # parts that cannot be compared with this framing
        self._id = re.compile(rf"0x([0-9A-F]{{{protocol.id_digits}}})\Z")

    def same(self, place: str, path: KeyPath, printed: object, encoded: object) -> bool:
        """Compare one place and record a difference."""
        self.compared += 1
        if printed == encoded:
            return True
        self._record(place, path, str(printed), str(encoded))
        return False

    def differs(self, place: str, path: KeyPath, printed: object, encoded: object) -> None:
        """Record a difference that was found in another way."""
        self.compared += 1
        self._record(place, path, str(printed), str(encoded))

    def _record(self, place: str, path: KeyPath, printed: str, encoded: str) -> None:
        """Record a difference; number the place if it already has another difference."""
        at, base = self.document.place(*path), place
        for number in itertools.count(2):
            found = Difference(place, at, printed, encoded)
            known = self.differences.setdefault(place, found)
            if (known.printed, known.encoded) == (printed, encoded):
                return
            place = f"{base}/{number}"

    def members(self, place: str, path: KeyPath, printed: set[str], encoded: set[str]) -> None:
        """Compare two sets of names, with a separate place for each name."""
        for name in sorted(printed | encoded):
            sides = (name if name in names else NOTHING for names in (printed, encoded))
            self.same(f"{place}/{name}", path, *sides)

    def names(
        self, place: str, path: KeyPath, printed: Sequence[str], fields: Sequence[Field]
    ) -> None:
        """Compare printed names with fields: wrong names, missing ones and further ones.

        :param place: the place, with braces for the field or the printed name.
        """
        missing = list(fields)
        for index, field in pair(printed, fields):
            name = printed[index]
            if field is None:
                self.differs(place.format(squash(name)), path, name, NOTHING)
                continue
            missing.remove(field)
            shown = field.name if same_name(name, field) else name
            self.same(place.format(field.name), path, shown, field.name)
        for field in missing:
            self.differs(place.format(field.name), path, NOTHING, field.name)

    def canonical(self, printed: str, path: KeyPath) -> str:
        """Return a printed message name as the registry spells it, and record lost underscores."""
        prefix = self.protocol.name_prefix
        name = printed.strip().replace("\t", " ")
        bare = name.rstrip(":;. ")
        self.same("names/punctuation", path, name.removeprefix(bare), "")
        for between in set(re.findall(r"[ _]+", bare)):
            self.same("names/blanks", path, between, "_")
        return re.sub(r"[ _]+", "_", bare).removeprefix(prefix)

    def named(self, where: str, printed: str, id: str | None, path: KeyPath) -> Message | None:
        """Find the message of a row by its name, or else by its id."""
        name = self.canonical(printed, path)
        message = self.messages.get(name)
        if message is None and id:
            message = self.with_id(id)
            if message is not None:
                self.same(f"{where}/{message.name}/name", path, name, message.name)
        if message is None:
            close = difflib.get_close_matches(name, self.messages, 1, 0.9)
            if close:
                self.same(f"{where}/{close[0]}/name", path, name, close[0])
                message = self.messages[close[0]]
        if message is None:
            self.unknown.append((self.document.place(*path), printed))
            return None
        self.witnessed.add(message.name)
        return message

    def shared_by(self, name: str, id: str) -> list[Message]:
        """Return the sub-messages with a printed name, or else with a printed id; often none."""
        shared = self.shared.get(name)
        number = shared.id if shared else self._number(id)
        return [message for (of, _), message in self.by_sub_message.items() if of == number]

    def sub_messages(self, of: str, title: str, number: int | None) -> list[Message]:
        """Return the messages that a row such as "Request/Get Quad_Readings" names, one for each verb.

        :param of: the words of the shared headings without a verb, such as QUAD_PARAM.
        """
        if number is None:
            return []
        verbs = _PARTS.match(title)
        found = []
        for part in _PART.findall(verbs[0]) if verbs else ():
            for name, shared in self.shared.items():
                message = self.by_sub_message.get((shared.id, number))
                bare = name.replace(f"_{_VERBS[part]}_", "_", 1)
                if message and bare != name and bare.startswith(of):
                    found.append(message)
        return found

    def with_id(self, printed: str) -> Message | None:
        """Find the message with a printed id; an id with a different number of digits matches none."""
        number = self._number(printed)
        return None if number is None else self.by_id.get(number)

    def _number(self, printed: str) -> int | None:
        match = self._id.match(printed)
        return int(match[1], 16) if match else None

    def id_of(self, message: Message) -> str:
        """Return the id of a message as the document prints ids."""
        return "none" if message.id is None else f"0x{message.id:0{self.protocol.id_digits}X}"

    def page_of(self, message: Message) -> int | str:
        """Return the page of a message in the document of the transcription."""
        return message.page_in(self.document.overlay) or NOTHING

    def misplace(self, path: KeyPath, what: str) -> None:
        """Record a part of the witness that cannot be compared with this framing."""
        self.misplaced.append((self.document.place(*path), what))
