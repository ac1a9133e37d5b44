# Generated from _devices/asynchronous/recorder.py by `python tools/unasync.py`; do not edit.

"""Records the statuses of parts of a device, while other calls continue."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self

from stagewire._codec.message import Message
from stagewire._devices.event_filter import EventFilter
from stagewire._devices.row_files import RowFile, check_path, create
from stagewire._devices.rows import Row, Rows
from stagewire._devices.synchronous.calls import look, replies_of, tell
from stagewire._devices.synchronous.transport import Endpoint, FramedTransport
from stagewire._devices.tables import ParameterSet, Query
from stagewire._devices.values import Values
from stagewire._devices.workers import Worker
from stagewire._sessions.subscriptions import BlockingSubscription
from stagewire.errors import (
    BadValueError,
    RecordingError,
    ReplyTimeoutError,
    SessionClosedError,
    StagewireError,
    UnsupportedError,
)

if TYPE_CHECKING:
    from types import TracebackType

_log = logging.getLogger("stagewire")

_FLUSH: Final = 1.0
"""Seconds after which a row is in the file at the latest."""
_MOMENT: Final = 0.01
"""Seconds that are waited at least, so that many short waits do not load the processor."""
_ENDING: Final = 5.0
"""Seconds that the file has to accept the last rows; a hung disk must not delay a stop for longer."""
_LIMIT: Final = 100_000
"""Statuses that may wait to be written."""


class Recorder:
    """A recording of statuses, one row for each; a context manager.

    It only switches status updates on and off, or polls a unit that sends none. An error of the recorder,
    such as a full disk, ends the recording and is raised at the end of the block. It never interrupts the
    block.

    :param parts: the parts, by name.
    :param to: file, or a function that is called with each row.
    :param overwrite: whether to replace an existing file.
    :param poll: seconds between two requests to a unit that sends no updates.
    :param listen: whether to send nothing.
    """

    def __init__(
        self,
        parts: Mapping[str, Endpoint],
        to: str | Path | Callable[[Row], object],
        *,
        overwrite: bool,
        poll: float,
        listen: bool = False,
    ) -> None:
        if isinstance(poll, bool) or not isinstance(poll, int | float) or not 0 < poll < 86_400:
            raise BadValueError(
                f"poll must be a number of seconds above 0 and below 86400, not {poll!r}"
            )
        if not isinstance(to, str | Path) and not callable(to):
            raise BadValueError(f"record takes the name of a file or a function, not {to!r}")
        self._parts = dict(parts)
        self._path = Path(to) if isinstance(to, str | Path) else None
        self._function = None if isinstance(to, str | Path) else to
        self._overwrite = overwrite
        self._poll = float(poll)
        self._listen = listen
        self.rows = 0
        """The number of rows so far."""
        self._file: RowFile | None = None
        self._worker = Worker()
        self._updates = next(iter(self._parts.values())).connection.updates
        self._subscriptions: dict[str, BlockingSubscription[Values[Any]]] = {}
        self._started: list[Endpoint] = []
        self._waiting: list[Row] = []
        self._begun = False
        self._over = False
        self._abandoned = False  # the file did not accept the last rows in time
        self._writing = threading.Lock()
        self._answered: set[str] = set()
        self._silent: dict[str, ReplyTimeoutError] = {}  # the last request, by part
        self._error: Exception | None = None

    def __repr__(self) -> str:
        return f"<{type(self).__name__} to {self._path or self._function!r}: {self.rows:,} rows>"

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the columns, once the recording has begun."""
        return tuple(self._rows.columns)

    @property
    def dropped(self) -> int:
        """The number of statuses that were lost because they were not written in time."""
        return sum(one.dropped for one in self._subscriptions.values())

    @property
    def error(self) -> Exception | None:
        """The error that has ended the recording early; it is raised at the end of the block."""
        return self._error

    # Begin and end

    def __enter__(self) -> Self:
        if self._begun:
            raise BadValueError("a recording can be used once: call record() again")
        self._begun = True
        if self._path is not None:
            check_path(self._path, overwrite=self._overwrite)
        first = next(iter(self._parts.values()))
        values = first.connection.facts.all_values()
        if self._updates is None and self._listen:
            name = first.connection.unit.name
            raise UnsupportedError(f"a {name} does not send status messages by itself")
        if self._updates is not None:
            messages: tuple[type[Message], ...] = self._updates.messages
        else:
            messages = replies_of(_query(first))
        kinds = {cls: values[cls] for cls in messages if cls in values}
        channels = {first.connection.channel_field(cls) for cls in kinds}
        self._rows = Rows(
            first.connection.unit,
            kinds,
            {name: part.scales() for name, part in self._parts.items()},
            next((field for field in channels if field), None),
            {name: _number(part) for name, part in self._parts.items()},
        )
        self._begin = first.now()
        try:
            if self._updates is not None:
                self._subscribe(tuple(kinds.values()))
                self._start()
            if self._path is not None:  # last, because it may replace a file
                self._file = create(self._path, self._rows.columns, overwrite=self._overwrite)
        except BaseException:
            self._stop()
            for subscription in self._subscriptions.values():
                subscription.close()
            if self._file is not None:
                self._file.discard()
            raise
        self._worker.start(self._run, f"stagewire record {self._path or ''}")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over = True
        self._worker.wake()
        try:
            self._stop()
            if self._worker.join(_ENDING):
                self._finish()
            else:
                self._abandoned = True
                self._error = self._error or TimeoutError(f"no write ended within {_ENDING:g} s")
        except BaseException:  # interrupted again
            with suppress(Exception):
                self._write(last=True)
            raise
        finally:
            for subscription in self._subscriptions.values():
                subscription.close()
        if self._error is None:
            return
        text = self._outcome(self._error)
        if error is None:
            raise RecordingError(text) from self._error
        _log.warning("%s", text)
        error.add_note(text)

    def _outcome(self, error: Exception) -> str:
        reason = (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
        return f"{self._path or 'the recording'} ends after {self.rows:,} rows: {reason}"

    def _finish(self) -> None:
        """Record the last statuses, and close the file."""
        if self._error is None:
            try:
                self._collect()
            except Exception as error:
                self._error = error
        try:
            self._worker.call(partial(self._write, last=True))
        except Exception as error:
            self._error = self._error or error
        for name, silent in self._silent.items():
            if name in self._answered or not self._answered:
                self._error = self._error or silent

    # In the background

    def _run(self) -> None:
        flush_at = poll_at = time.monotonic()
        try:
            while not self._over:
                if self._updates is not None:
                    self._collect()
                elif time.monotonic() >= poll_at:
                    poll_at = time.monotonic() + self._poll
                    self._poll_all()
                if time.monotonic() >= flush_at:
                    flush_at = time.monotonic() + _FLUSH
                    self._worker.call(self._write)
                until = flush_at if self._updates is not None else min(flush_at, poll_at)
                self._worker.wait(max(until - time.monotonic(), _MOMENT))
        except SessionClosedError:  # while polling
            pass
        except Exception as error:
            self._error = error
            _log.warning("%s", self._outcome(error))  # the block may continue for long
        if not self._waiting and not self._abandoned:
            return
        try:
            self._worker.call(partial(self._write, last=self._abandoned))
        except Exception as error:
            self._error = self._error or error

    def _add(self, name: str, status: Values[Any]) -> None:
        """Add the row of a status."""
        row = self._rows.row(name, status, self._begin)
        self.rows += 1
        if self._function is not None:
            self._function(row)
        else:
            self._waiting.append(row)

    def _write(self, *, last: bool = False) -> None:
        """Pass the rows to the file, and close it at the end."""
        if self._file is None:
            return
        with self._writing:
            rows, self._waiting = self._waiting, []
            try:
                if rows:
                    self._file.write(rows)
            except Exception:
                self.rows -= len(rows)
                raise
            finally:
                if last:
                    self._file.close()

    # Statuses that the unit sends

    def _subscribe(self, classes: tuple[type[Values[Any]], ...]) -> None:
        for name, part in self._parts.items():
            transport = part.transport
            assert isinstance(transport, FramedTransport)  # only these have updates
            events = EventFilter(part, classes)
            kind = part.connection.unit.kind
            source = part.address if kind in ("rack", "bay") else None
            subscription = transport.session.subscribe_as(
                events.read, events.wanted, _LIMIT, source
            )
            subscription.call_on_event(self._worker.wake)
            self._subscriptions[name] = subscription

    def _collect(self) -> None:
        """Add a row for each status that has arrived."""
        ended: StagewireError | None = None
        taken: list[tuple[str, Values[Any]]] = []
        for name, subscription in self._subscriptions.items():
            while (status := subscription.take()) is not None:
                taken.append((name, status))
            try:
                subscription.check()
            except SessionClosedError:  # the user closed the device
                self._over = True
            except StagewireError as error:
                ended = error
        for name, status in sorted(taken, key=lambda one: one[1].received):
            self._add(name, status)
        if ended is not None:
            raise ended

    def _start(self) -> None:
        """Start the updates of each controller, unless they were started before."""
        assert self._updates is not None
        if self._listen:
            return
        for part in {part.address: part for part in self._parts.values()}.values():
            table = self._updates.start
            must_start = part.connection.share_updates(part.address, self)
            self._started.append(part)
            if must_start:
                given = {entry.keyword: entry.default for entry in table.given}
                tell(part, table, None, given)

    def _stop(self) -> None:
        """Stop the updates that only this recording needed."""
        for part in self._started:
            assert self._updates is not None
            if part.connection.release_updates(part.address, self):
                with suppress(StagewireError):  # the line is lost or closed
                    tell(part, self._updates.stop, None, {})
        self._started.clear()

    # Statuses that are requested

    def _poll_all(self) -> None:
        """Add a row for each part; of several, those that do not answer are left out, one in each round."""
        for name, part in tuple(self._parts.items()):
            if self._over:
                return
            try:
                status = look(part, _query(part), part.seconds(None))
            except ReplyTimeoutError as error:  # one lost reply is one row less
                if self._answered and name not in self._answered:
                    del self._parts[name]
                    _log.warning("%s does not answer and is not recorded: %s", name, error)
                    return
                self._silent[name] = error
            else:
                self._add(name, status)
                self._answered.add(name)
                self._silent.pop(name, None)


def _number(part: Endpoint) -> int:
    """Return the number of a channel, counted from 1; 0 for a part that is not a channel."""
    idents = part.connection.unit.channel_idents
    return idents.index(part.channel) + 1 if part.channel in idents else 0


def _query(part: Endpoint) -> ParameterSet[Any] | Query[Any]:
    unit = part.connection.unit
    if unit.status_query is None:
        raise UnsupportedError(f"a {unit.name} has no status that can be recorded")
    return unit.status_query
