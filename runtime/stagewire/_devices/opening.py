"""What ``open`` of a class for asyncio returns: a controller to be awaited, or entered."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar


class _Openable(Protocol):
    """A device that is not open yet."""

    async def _connect(self) -> None: ...

    async def close(self) -> None:
        """Close it."""


D = TypeVar("D", bound=_Openable)


class Opening(Generic[D]):
    """A controller that is about to be opened: await it, or enter it by ``async with``.

    :param device: not open yet.
    """

    def __init__(self, device: D) -> None:
        self._device = device

    if not TYPE_CHECKING:  # which knows it already

        def __getattr__(self, name: str) -> Any:
            raise AttributeError(
                f"it is not open yet and has no {name}: await it, as in `tdc = await TDC001.open(...)`, or "
                "enter it by `async with`"
            )

        def __enter__(self) -> D:
            raise TypeError(
                "it is opened by `async with`, or by `await`; `with` is for the classes outside aio"
            )

        def __exit__(self, *error: object) -> None:
            raise NotImplementedError  # nothing was entered

    async def _open(self) -> D:
        await self._device._connect()
        return self._device

    def __await__(self) -> Generator[Any, Any, D]:
        return self._open().__await__()

    async def __aenter__(self) -> D:
        return await self._open()

    async def __aexit__(self, *error: object) -> None:
        await self._device.close()
