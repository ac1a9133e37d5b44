"""The pytest fixture ``virtual``.

Enable it with one line in the outermost ``conftest.py``:
``pytest_plugins = ["stagewire_virtual.pytest_plugin"]``. It is not registered as an entry point of pytest:
then pytest would rewrite the assertions of the whole distribution at each start, and the name ``virtual``
would be taken, in the tests of every project.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from stagewire_virtual import factory
    from stagewire_virtual.controller import VirtualController

__all__ = ["Controllers", "virtual"]


class Controllers:
    """The contents of ``stagewire_virtual``; controllers that it makes are closed at the end of the test.

    Annotate a test with ``virtual: Controllers``.
    """

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack

    if TYPE_CHECKING:
        from stagewire_virtual.clock import SteppedClock
        from stagewire_virtual.errors import VirtualError
        from stagewire_virtual.options import LinkKind, Options, Settings

        rack = staticmethod(factory.rack)
        replay_of = staticmethod(factory.replay_of)

        def __getattr__(self, name: str) -> factory.Factory: ...  # units by name

    else:

        def __getattr__(self, name: str) -> Any:
            """Return an attribute of the package; controllers that it makes are closed at the end."""
            import stagewire_virtual

            found = getattr(stagewire_virtual, name)
            makes = name in ("rack", "replay_of") or name not in stagewire_virtual.__all__
            return self._closed_at_the_end(found) if makes else found

    def _closed_at_the_end(
        self, make: Callable[..., VirtualController]
    ) -> Callable[..., VirtualController]:
        def make_and_remember(*arguments: Any, **options: Any) -> VirtualController:
            return self._stack.enter_context(make(*arguments, **options))

        return make_and_remember


@pytest.fixture
def virtual() -> Iterator[Controllers]:
    """Virtual controllers: ``virtual.TDC001(stage=stages.Z8)``, closed at the end of the test."""
    with ExitStack() as stack:
        yield Controllers(stack)
