"""Texts of the errors of sessions: what was sent, what was expected, what came instead, and what to do."""

from __future__ import annotations

from collections.abc import Iterable

from stagewire._framings.header.frame import Received, Undocumented
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.header.table import Fault
from stagewire._sessions.framed_exchanges import FramedExchange, Halt, Motion
from stagewire._sessions.receiver import Receiver
from stagewire.errors import ControllerFaultError, MotionTimeoutError, ReplyTimeoutError

_UNDER_WAY = "it may still be under way: read the status, or stop it, before anything else is begun"


class ErrorTexts:
    """Texts about exchanges of a protocol.

    :param protocol: it knows the names.
    :param hearing: it knows what has come, up to now.
    """

    def __init__(self, protocol: FramedProtocol, hearing: Receiver) -> None:
        self._forms = protocol.framing.forms
        self._receiver = hearing

    def timeout(self, exchange: FramedExchange, kept_by: str) -> ReplyTimeoutError:
        """Return the error of something whose time is over.

        :param kept_by: what keeps it from being sent, if it was not.
        """
        kind = MotionTimeoutError if isinstance(exchange, Motion) else ReplyTimeoutError
        if exchange.written:
            return kind(self._unanswered(exchange))
        if isinstance(exchange, Halt):  # nothing but the line itself keeps it
            return kind(
                f"{exchange.name} to {exchange.dest:#04x} was not sent within {_seconds(exchange)} s: the "
                "line takes nothing; it goes out as soon as the line does, so see whether anything moves"
            )
        return kind(
            f"{exchange.name} to {exchange.dest:#04x} was not sent: "
            f"{kept_by} for all of its {_seconds(exchange)} s; "
            "give it more time, or ask for less at once"
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
                "see that the controller is on and has this address and message, then ask again; "
                "a late answer is not taken for another"
            )
        return (
            f"{exchange.name} ({exchange.raw.hex(' ')}) was sent to {exchange.dest:#04x}, and no {awaited} "
            f"came from there within {_seconds(exchange)} s; meanwhile came {came}{passed_over}; "
            f"{'; '.join([*advices, advice])}"
        )

    def _passed_over(self, exchange: FramedExchange) -> tuple[str, list[str]]:
        """Return which of the awaited messages came and were nobody's, and what to do about it."""
        parts = [
            f"{count} x {self._name(id)} {why} (the last: {raw.hex(' ')})"
            for (id, why, _), (count, raw) in exchange.passed_over.items()
        ]
        advices = dict.fromkeys(advice for _, _, advice in exchange.passed_over if advice)
        return (f"; not taken for it: {', '.join(parts)}" if parts else ""), list(advices)

    def _names(self, ids: Iterable[int]) -> str:
        return " or ".join(sorted(self._name(id) for id in ids))

    def _name(self, id: int | str) -> str:
        if isinstance(id, str):
            return id
        return self._forms[id].name if id in self._forms else f"{id:#06x}"

    def _came(self, exchange: FramedExchange) -> str:
        """Return what came since something was written, by names.

        A fault report is followed by its code and text, another message without a layout by its bytes.

        Bytes that are no known message are told where nothing else came: with a wrong baud rate, or another
        controller, there is nothing else.
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
            f"{odd} bytes that are no message (another baud rate, or another kind of controller?)"
        )


def _seconds(exchange: FramedExchange) -> str:
    """Return how long something was awaited, for people: what is left of 2 s is still 2 s to them."""
    return f"{round(exchange.timeout, 3):g}"
