"""The fields of a message as text, quickly: captures hold millions of frames and few layouts."""

from __future__ import annotations

import json
from collections.abc import Callable
from operator import attrgetter
from typing import Any

from stagewire.columns import Kind, shape_of
from stagewire.protocols import FramedMessage, Message, UndecidedMessage, UndocumentedMessage

__all__ = ["AS_JSON", "AS_WORDS", "FieldsText", "compact"]

AS_JSON = ('"%s":%%d', ",")
AS_WORDS = ("%s=%%d", " ")

_Values = Callable[[Any], Any]


class FieldsText:
    """Texts for the fields of messages whose fields are all integers and always shown.

    For every such class a template is made once. It gives what ``frame_answer`` would; all other
    messages have to go through that.

    :param style: how one field is written, and what stands between two.
    """

    def __init__(self, style: tuple[str, str]) -> None:
        self._item, self._joint = style
        self._known: dict[type[Message], tuple[str, _Values] | None] = {}

    def of(self, message: Message) -> str | None:
        """Return the text; None for a message that no template fits."""
        cls = message.__class__
        try:
            known = self._known[cls]
        except KeyError:
            known = self._known[cls] = self._template(cls)
        if known is None:
            return None
        template, values = known
        text: str = template % values(message)
        return text

    def _template(self, cls: type[Message]) -> tuple[str, _Values] | None:
        if not issubclass(cls, FramedMessage) or cls.layout.unnamed:
            return None
        if issubclass(cls, (UndecidedMessage, UndocumentedMessage)):
            return None
        places = shape_of(cls).places
        if any(place.kind in (Kind.TEXT, Kind.BYTES) for place in places):
            return None
        names = [place.name for place in places]
        template = self._joint.join(self._item % name for name in names)
        return template, attrgetter(*names) if names else lambda _: ()


def compact(value: object) -> str:
    """Return JSON without blanks."""
    return json.dumps(value, separators=(",", ":"))
