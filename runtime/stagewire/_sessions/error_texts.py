"""Error messages of sessions: what was sent, what was expected, what arrived instead, and what to do."""

from __future__ import annotations

from collections.abc import Iterable

from stagewire._framings.header.frame import Received, Undocumented
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.header.table import Fault
from stagewire._sessions.framed_exchanges import FramedExchange, Halt, Motion
from stagewire._sessions.receiver import Receiver
from stagewire.errors import ControllerFaultError, MotionTimeoutError, ReplyTimeoutError

_UNDER_WAY = "it may still be in progress: read the status, or stop it, before the next motion"


class ErrorTexts:
    """Error messages about the exchanges of a protocol.

    :param protocol: the protocol, for names.
    :param hearing: the receiver, for what has arrived so far.
    """

    def __init__(self, protocol: FramedProtocol, hearing: Receiver) -> None:
        self._names_of = protocol.framing.names
        self._receiver = hearing

    def timeout(self, exchange: FramedExchange, kept_by: str) -> ReplyTimeoutError:
        """Return the error of an exchange whose timeout has passed.

        :param kept_by: the reason why it was not sent, if it was not.
        """
        kind = MotionTimeoutError if isinstance(exchange, Motion) else ReplyTimeoutError
        if exchange.written:
            return kind(self._unanswered(exchange))
        if isinstance(exchange, Halt):  # only the link itself can delay a stop
            return kind(
                f"{exchange.name} to {exchange.dest:#04x} was not sent within {_seconds(exchange)} s: the "
                "link accepts no bytes; it is sent as soon as it does, so check whether anything moves"
            )
        return kind(
            f"{exchange.name} to {exchange.dest:#04x} was not sent: "
            f"{kept_by} for all of its {_seconds(exchange)} s; "
            "allow more time, or send fewer requests at a time"
        )

    def fault(
        self, motion: Motion, event: Received | Undocumented, fault: Fault
    ) -> ControllerFaultError:
        """Return the error of a motion during which the controller reported a fault."""
        text = (
            f"{motion.name} ({motion.raw.hex(' ')}) was sent to {motion.dest:#04x}, and the controller "
            f"reported a fault: {self._name(event.id)} {fault}; {_UNDER_WAY}"
        )
        return ControllerFaultError(text, fault.code, fault.text, event.frame.message)

    def _unanswered(self, exchange: FramedExchange) -> str:
        awaited = self._names(exchange.ids)
        came = self._came(exchange)
        passed_over, advices = self._passed_over(exchange)
        if isinstance(exchange, Motion):
            advice = _UNDER_WAY
        elif isinstance(exchange, Halt):
            advice = "it may still be moving: stop it again, or read the status"
        else:
            advice = (
                "check that the controller is on and has this address and message, then send the request "
                "again; a late reply is never matched to another request"
            )
        return (
            f"{exchange.name} ({exchange.raw.hex(' ')}) was sent to {exchange.dest:#04x}, but no {awaited} "
            f"arrived from there within {_seconds(exchange)} s; received meanwhile: {came}{passed_over}; "
            f"{'; '.join([*advices, advice])}"
        )

    def _passed_over(self, exchange: FramedExchange) -> tuple[str, list[str]]:
        """Return the awaited messages that arrived but did not match, and advice for each."""
        parts = [
            f"{count} x {self._name(id)} {why} (the last: {raw.hex(' ')})"
            for (id, why, _), (count, raw) in exchange.passed_over.items()
        ]
        advices = dict.fromkeys(advice for _, _, advice in exchange.passed_over if advice)
        return (f"; not matched: {', '.join(parts)}" if parts else ""), list(advices)

    def _names(self, ids: Iterable[int]) -> str:
        return " or ".join(sorted(self._name(id) for id in ids))

    def _name(self, id: int | str) -> str:
        if isinstance(id, str):
            return id
        return self._names_of.get(id) or f"{id:#06x}"

    def _came(self, exchange: FramedExchange) -> str:
        """Return what arrived since the exchange was written, by name.

        A fault report is followed by its code and text, another message without a layout by its bytes.

        Bytes that are not a known message are mentioned only if nothing else arrived: with a wrong baud rate
        or another kind of controller, there is nothing else.
        """
        parts = []
        for id, count in self._receiver.seen().items():
            if new := count - exchange.seen.get(id, 0):
                raw = self._receiver.undecoded.get(id)
                shown = "" if raw is None else f" ({raw.hex(' ')})"
                fault = self._receiver.faults.get(id)
                if fault is not None and (fault.code or fault.text):
                    shown = f" ({fault})"
                parts.append(f"{new} x {self._name(id)}{shown}")
        if parts:
            return ", ".join(parts)
        odd = self._receiver.heard - exchange.after
        if not odd:
            return "nothing"
        return (
            f"{odd} bytes that are not a message (wrong baud rate, or another kind of controller?)"
        )


def _seconds(exchange: FramedExchange) -> str:
    """Return how long an exchange was awaited, for people, who do not care about the rest of 2 s."""
    return f"{round(exchange.timeout, 3):g}"
