"""Choice of the protocol that a command works on."""

from __future__ import annotations

import difflib
from collections.abc import Callable

import typer

from stagewire.errors import UnknownProtocolError, UnusableProtocolError
from stagewire.protocols import Protocol, available_protocols, load_protocol
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.output import printable

PROTOCOL_HELP = "Protocol; needed only if the other arguments are ambiguous."


def choose(name: str | None, fits: Callable[[Protocol], bool]) -> Protocol:
    """Return the protocol with this name, or the only installed one, or the only one that ``fits``."""
    if name is not None:
        return _named(name)
    everything = _installed()
    fitting = [protocol for protocol in everything if fits(protocol)]
    if len(everything) == 1 or len(fitting) == 1:
        return (fitting or everything)[0]
    raise CalledWronglyError(f"{_several(fitting or everything)}; choose one with --protocol")


def choose_by_message(name: str | None, message: str) -> Protocol:
    """Return the protocol with this name, or the only installed one that has the message."""
    if name is not None:
        return _named(name)
    known = {protocol: _messages(protocol) for protocol in _installed()}
    having = [protocol for protocol, names in known.items() if message.upper() in names]
    if len(having) == 1 or len(known) == 1:
        return (having or list(known))[0]
    if having:
        raise CalledWronglyError(
            f"{_several(having)} have a message {message}; choose one with --protocol"
        )
    names = sorted({name for names in known.values() for name in names})
    close = difflib.get_close_matches(message.upper()[:80], names, n=3)
    like = f"; did you mean {' or '.join(close)}?" if close else ""
    raise CalledWronglyError(f"no installed protocol has a message {message}{like}")


def one_or_all(name: str | None, *, whole: bool = False) -> list[Protocol]:
    """Return the protocol with this name, or without a name all installed ones.

    With ``whole`` an unusable protocol is an error; otherwise it is skipped with a note.
    """
    return _installed(whole=whole) if name is None else [_named(name)]


def _installed(*, whole: bool = False) -> list[Protocol]:
    found = []
    for name in available_protocols():
        try:
            found.append(load_protocol(name))
        except UnusableProtocolError as error:  # one broken package must not disable the others
            if whole:
                raise CalledWronglyError(str(error)) from None
            typer.echo(f"stagewire: skipped: {printable(str(error))}", err=True)
    if not found:
        raise CalledWronglyError("no protocol is installed; install stagewire, or its checkout")
    return found


def _named(name: str) -> Protocol:
    try:
        return load_protocol(name)
    except UnknownProtocolError as error:
        raise CalledWronglyError(str(error)) from None


def _messages(protocol: Protocol) -> set[str]:
    """Return all names of messages in capitals, including those of messages that cannot be used."""
    names = (
        *(cls.layout.message for cls in protocol.messages),
        *protocol.aliases,
        *protocol.nameless,
    )
    return {name.upper() for name in names}


def _several(protocols: list[Protocol]) -> str:
    return f"several protocols ({', '.join(protocol.name for protocol in protocols)})"
