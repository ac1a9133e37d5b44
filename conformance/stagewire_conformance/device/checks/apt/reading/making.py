"""What makes the checks in which something odd is sent, and a clean request behind it has to be answered."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from stagewire_conformance.device.check import Check
from stagewire_conformance.device.checks.apt.clean import clean_request

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared
    from stagewire_conformance.device.trial import Trial

__all__ = ["checks_of"]

_What = TypeVar("_What")


def checks_of(
    kind: str,
    sent: Mapping[str, tuple[_What, str]],
    run: Callable[[_What, Trial], None],
    declared: Declared,
    *,
    seconds: float,
) -> Iterator[Check]:
    """Give a check for each odd thing that is sent; skipped where nothing could show that all is well.

    :param sent: name of a check within its kind -> what is sent, as ``run`` takes it, and the title.
    :param run: sends it, and sees that a clean request is answered.
    """
    request = clean_request(declared)
    for name, (what, title) in sent.items():
        yield Check(
            id=f"{kind}/{name}",
            title=title,
            messages=() if request is None else request.messages,
            run=partial(run, what),
            skip="no request is claimed that could show that all is well"
            if request is None
            else "",
            seconds=seconds,
        )
