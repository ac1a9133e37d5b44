"""Which protocol a command works on."""

from __future__ import annotations

from stagewire.errors import UnknownProtocolError
from stagewire.protocol import Protocol, available_protocols, load_protocol
from stagewire_cli.errors import CalledWronglyError

__all__ = ["PROTOCOL_HELP", "choose"]

PROTOCOL_HELP = "Protocol; needed only where several are installed."


def choose(name: str | None) -> Protocol:
    """Return the protocol of this name, or the only one that is installed."""
    installed = available_protocols()
    if name is None:
        if len(installed) == 1:
            return load_protocol(installed[0])
        if not installed:
            raise CalledWronglyError("no protocol is installed; install stagewire, or its checkout")
        names = ", ".join(installed)
        raise CalledWronglyError(f"several protocols are installed ({names}); choose by --protocol")
    try:
        return load_protocol(name)
    except UnknownProtocolError as error:
        raise CalledWronglyError(str(error)) from None
