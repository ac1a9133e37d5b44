"""The return value of ``open`` for asyncio, which is awaited or entered."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar


class _Openable(Protocol):
    """A device that is not open yet."""

    async def _connect(self) -> None: ...

    async def __aexit__(self, *error: Any) -> None: ...


D = TypeVar("D", bound=_Openable)


class Opening(Generic[D]):
    """A controller that is not open yet: await it, or enter it with ``async with``.

    :param device: device to open.
    """

    def __init__(self, device: D) -> None:
        self._device = device

    if not TYPE_CHECKING:  # type checkers know the methods already

        def __getattr__(self, name: str) -> Any:
            raise AttributeError(
                f"the device is not open yet and has no attribute {name!r}: await it, as in "
                "`tdc = await TDC001.open(...)`, or use `async with`"
            )

        def __enter__(self) -> D:
            raise TypeError(
                "use `async with` or `await`: `with` is only for devices outside the aio packages"
            )

        def __exit__(self, *error: object) -> None:
            raise NotImplementedError  # `__enter__` always raises

    async def _open(self) -> D:
        await self._device._connect()
        return self._device

    def __await__(self) -> Generator[Any, Any, D]:
        return self._open().__await__()

    async def __aenter__(self) -> D:
        return await self._open()

    async def __aexit__(self, *error: object) -> None:
        await self._device.__aexit__(*error)
