"""Controllers whose parts are used by devices of ophyd-async.

A controller is described when a device is created, and opened when the device connects. So devices can be
created, and connected with ``mock=True``, without a port. All devices of a controller share its line.
"""

from __future__ import annotations

import asyncio
from typing import Any

from ophyd_async.core import NotConnectedError

from stagewire.errors import StagewireError


class Reference:
    """A part of a controller that may not be open yet: a channel, a bay, an axis, or the controller itself.

    :param controller: the controller; None: this object itself.
    :param kind: class of the part, such as ``TDC001`` or ``BBD102Bay`` of :mod:`stagewire_apt.aio`.
    :param steps: names of calls and their arguments that lead from the controller to the part.
    """

    def __init__(
        self,
        controller: Controller | None,
        kind: type[Any],
        steps: tuple[tuple[str, int | str], ...] = (),
    ) -> None:
        self._controller = controller
        self.kind = kind
        self._steps = steps

    @property
    def controller(self) -> Controller:
        """The controller of the part."""
        assert self._controller is not None  # a Controller is its own
        return self._controller

    @property
    def source(self) -> str:
        """The source of values of the part, for documents: the URL, and the name of the part."""
        return " ".join(
            (self.controller.url, *(f"{name} {argument}" for name, argument in self._steps))
        )

    @property
    def part(self) -> Any:
        """The open part, an object of the class :attr:`kind`.

        Raise :class:`~ophyd_async.core.NotConnectedError` if the controller is not open.
        """
        part = self.controller.device
        for name, argument in self._steps:
            part = getattr(part, name)(argument)
        return part

    def bay(self, number: int) -> Reference:
        """Return a bay of a rack, counted from 1."""
        return self._inside("bay", number)

    def channel(self, number: int) -> Reference:
        """Return a channel of a controller or bay with several, counted from 1."""
        return self._inside("channel", number)

    def axis(self, name: str) -> Reference:
        """Return an axis of an MS-2000, such as ``X``."""
        return self._inside("axis", name)

    def _inside(self, name: str, argument: int | str) -> Reference:
        kind = getattr(self.kind, f"{name}_class", None)
        if kind is None:
            raise ValueError(f"{self.kind.__name__} has no parts of the kind {name!r}")
        return Reference(self.controller, kind, (*self._steps, (name, argument)))

    def require(self, method: str, what: str) -> None:
        """Raise :class:`TypeError` unless the part has a method, which the device ``what`` needs."""
        if hasattr(self.kind, method):
            return
        inside = [
            f".{name}({example})"
            for name, example in (("bay", "1"), ("channel", "1"), ("axis", "'X'"))
            if hasattr(getattr(self.kind, f"{name}_class", None), method)
        ]
        where = f"; use a part of it: {' or '.join(inside)}" if inside else ""
        raise TypeError(f"{self.kind.__name__} cannot be a {what}: it has no {method}{where}")


class Controller(Reference):
    """A controller, opened when the first of its devices connects.

    :param kind: class of the controller for asyncio, such as ``stagewire_apt.aio.TDC001``.
    :param url: line, as for ``open``, such as ``/dev/ttyUSB0`` or ``virtual://TDC001``.
    :param options: options of ``open``, such as ``stage="Z8"`` and ``travel_mm=12``. Without ``on_close``,
        motions are stopped when the controller is closed or the program ends.

    An MS-2000 is switched to its low-level format when it is opened.
    """

    def __init__(self, kind: type[Any], url: str, **options: Any) -> None:
        super().__init__(None, kind)
        self.url = url
        self._options = options
        self._device: Any = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._lock: asyncio.Lock | None = None

    def __repr__(self) -> str:
        return f"<Controller {self.kind.__name__} at {self.url}>"

    @property
    def controller(self) -> Controller:
        """The controller itself."""
        return self

    @property
    def device(self) -> Any:
        """The open controller.

        Raise :class:`~ophyd_async.core.NotConnectedError` if it is not open.
        """
        if self._device is None:
            raise NotConnectedError(
                f"{self.kind.__name__} at {self.url} is not open: connect first"
            )
        return self._device

    @property
    def is_open(self) -> bool:
        """Whether the controller was opened; its line may have been lost since."""
        return self._device is not None

    @property
    def motion_timeout(self) -> float:
        """The timeout of motions in seconds, as for ``open``."""
        return float(self._options.get("motion_timeout", 60.0))

    async def connect(self) -> None:
        """Open the controller, or open it again if its line was lost or closed.

        Nothing moves. An open line stays open, so this does not disturb other devices of the controller.

        Raise :class:`~ophyd_async.core.NotConnectedError`.
        """
        loop = asyncio.get_running_loop()
        if self._loop not in (None, loop):
            raise NotConnectedError(
                f"{self.kind.__name__} at {self.url} was opened in another event loop: connect all devices "
                "in the loop of one RunEngine"
            )
        if self._lock is None:
            self._loop, self._lock = loop, asyncio.Lock()
        async with self._lock:
            try:
                await self._open()
            except StagewireError as error:
                raise NotConnectedError(str(error)) from error

    async def _open(self) -> None:
        if self._device is None:
            self._device = await self.kind.open(self.url, **self._options)
        elif self._device.session.lost or self._device.session.closed:
            await self._device.reconnect()
        else:
            return
        if hasattr(self.kind, "switch_to_low_level"):
            await self._device.switch_to_low_level()

    async def close(self) -> None:
        """Stop the motions that were started here, and close the line. ``connect`` opens it again."""
        if self._device is not None:
            await self._device.close()
