"""``--message NAME[:FORM]`` and ``--status``: which message is wanted, and what decides its layout."""

from __future__ import annotations

from collections.abc import Mapping

from stagewire.errors import BadValueError, CodecError
from stagewire.message import Message, UndecidedMessage
from stagewire.protocol import Protocol
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.writer import Task
from stagewire_conformance.codec import Codec

__all__ = ["task_of"]


def task_of(protocol: Protocol, status: str | None, message: str | None) -> Task:
    """Return what is to be decoded, from what the user said.

    A form such as ``data:dc`` says the status as well. Raises :class:`CalledWronglyError`.
    """
    context = None if status is None else {"status": status}
    try:
        Codec(protocol).check_context(context)
    except BadValueError as error:
        raise CalledWronglyError(f"--status: {error}") from None
    if message is None:
        return Task(protocol, context)
    only = _wanted(protocol, message, context or {})
    return Task(protocol, _agreed(only, context), only)


def _wanted(protocol: Protocol, text: str, context: Mapping[str, str]) -> type[Message]:
    name, colon, form = text.partition(":")
    spelled = {cls.layout.message.lower(): cls.layout.message for cls in protocol.messages}
    name = spelled.get(name.lower(), name)
    if not colon:
        for cls in protocol.messages:
            when = cls.layout.when
            if cls.layout.message == name and when and when.items() <= context.items():
                return cls
    try:
        return protocol.message_class(name, form if colon else None)
    except CodecError as error:
        raise CalledWronglyError(f"--message: {error}") from None


def _agreed(only: type[Message], context: dict[str, str] | None) -> dict[str, str] | None:
    """Return the context that gives frames the wanted layout; raise where another was asked for."""
    layout = only.layout
    if context and issubclass(only, UndecidedMessage):
        raise CalledWronglyError(f"--message: {layout.form} is how frames come without --status")
    if not layout.when:
        return context
    if context and not layout.when.items() <= context.items():
        said = ", ".join(f"--{key} {value}" for key, value in context.items())
        raise CalledWronglyError(f"--message: the form {layout.form} contradicts {said}")
    return {**layout.when, **(context or {})}
