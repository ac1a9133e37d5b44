"""Requests that were sent: which of them wait for a reply, and which late replies may still arrive.

A reply to a request that was given up looks like the reply to the next request of the same kind. So its key
(address, messages and selected fields) is *poisoned*: the same request waits until the late reply has
arrived and was discarded, or a quiet period has passed. Other requests continue.
"""

from __future__ import annotations

from math import inf

from stagewire._framings.header.frame import Received, Undocumented
from stagewire._sessions.framed_exchanges import Ask
from stagewire._sessions.matching import Matching
from stagewire._sessions.statistics import Statistics


class Requests:
    """The requests of one line that were sent.

    :param matching: matches frames to exchanges.
    :param statistics: counts them.
    :param quiet: seconds for which a request that was given up blocks the same request.
    """

    def __init__(self, matching: Matching, statistics: Statistics, quiet: float) -> None:
        self._matching = matching
        self._statistics = statistics
        self._quiet = quiet
        self.awaited: dict[int, list[Ask]] = {}
        """Message -> the requests that it may answer, including those that were given up."""
        self.outstanding: dict[int, Ask] = {}
        """Address -> the request that waits for its reply; at most one."""
        self._given_up: list[Ask] = []
        self._nameless = False  # a controller answers without an address

    def sent(self, ask: Ask) -> None:
        """Note a request that is written now."""
        self.outstanding[ask.dest] = ask
        for id in ask.ids:
            awaiting = self.awaited.get(id)
            if awaiting is None:
                self.awaited[id] = [ask]
            else:
                awaiting.append(ask)

    def may_be_sent(self, ask: Ask) -> bool:
        """Whether no other request at its address must be answered first.

        If replies have no address, whether none at any address must: the replies could not be distinguished.
        """
        return not (self._nameless and self.outstanding) and ask.dest not in self.outstanding

    def is_poisoned(self, ask: Ask) -> bool:
        """Whether the late reply to the same request may still arrive."""
        return any(self._same(old, ask) for old in self._given_up)

    def _same(self, old: Ask, new: Ask) -> bool:
        if (old.dest != new.dest and not self._nameless) or old.ids.isdisjoint(new.ids):
            return False
        selected = dict(old.selected)
        return all(selected.get(name, value) == value for name, value in new.selected)

    def answer(self, id: int, event: Received | Undocumented, began: int) -> bool:
        """Give a frame to the request that it answers; return whether others should not receive it.

        :param began: number of bytes received before the frame.
        """
        frame = event.frame
        message = frame.message
        source = self._matching.source_of(event.raw)
        found: Ask | None = None
        for ask in self.awaited[id]:
            if began < ask.after or (source is not None and source != ask.dest):
                continue
            for name, value in ask.selected:
                if getattr(message, name, value) != value:
                    break
            else:
                if found is not None:
                    self._statistics.ambiguous += 1
                    self._nameless = True
                    self._pass_over(id, event, began)
                    return False
                found = ask
        if found is None:
            self._pass_over(id, event, began)
            return False
        if source is None:
            self._nameless = True
        self._remove(found)
        if found.done:
            self._given_up.remove(found)
            self._statistics.late += 1
        else:
            del self.outstanding[found.dest]
            self._statistics.matched += 1
            found.end(frame)
        return not message.layout.unsolicited

    def _pass_over(self, id: int, event: Received | Undocumented, began: int) -> None:
        for ask in self.awaited[id]:
            self._matching.pass_over(ask, event, began)

    def give_up(self, ask: Ask, now: float) -> None:
        """Poison a request that was given up."""
        del self.outstanding[ask.dest]
        ask.until = now + self._quiet
        self._given_up.append(ask)

    def forgive(self, now: float) -> None:
        """Stop expecting late replies whose quiet period has passed."""
        for ask in [ask for ask in self._given_up if ask.until <= now]:
            self._given_up.remove(ask)
            self._remove(ask)

    @property
    def next(self) -> float:
        """When the next quiet period ends."""
        return min((ask.until for ask in self._given_up), default=inf)

    def _remove(self, ask: Ask) -> None:
        for id in ask.ids:
            awaiting = self.awaited[id]
            awaiting.remove(ask)
            if not awaiting:
                del self.awaited[id]
