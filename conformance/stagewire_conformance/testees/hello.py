"""What a testee says of itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stagewire_conformance.testee import TESTEE
from stagewire_conformance.testees.errors import NotATesteeError

__all__ = ["REQUEST", "Hello", "read"]

REQUEST = {"id": 0, "op": "hello"}


@dataclass(frozen=True, slots=True)
class Hello:
    """Who a testee is and what it can do.

    :param implementation: its name.
    :param version: its own version.
    :param protocols: the protocols that it speaks, by name.
    :param operations: of ``decode``, ``encode`` and ``stream`` those that it has; ``hello`` it has.
    """

    implementation: str
    version: str
    protocols: tuple[str, ...]
    operations: tuple[str, ...]


def read(answer: Mapping[str, Any]) -> Hello:
    """Return what an answer to ``hello`` says.

    Raises :class:`NotATesteeError` for an answer that says something else, or speaks of another version of
    the testee protocol than that of this suite.
    """
    if answer.get("ok") is not True:
        raise NotATesteeError(f"it refuses hello: {answer.get('detail') or answer.get('error')}")
    if answer.get("id") != REQUEST["id"]:
        raise NotATesteeError(f"its answer to hello has the id {answer.get('id')!r}, not 0")
    version = answer.get("testee")
    if version != TESTEE or isinstance(version, bool):
        raise NotATesteeError(
            f"it speaks version {version!r} of the testee protocol; this suite speaks {TESTEE}"
        )
    for key in ("implementation", "version"):
        if not isinstance(answer.get(key), str):
            raise NotATesteeError(f"its answer to hello has no {key}, as text")
    for key in ("protocols", "operations"):
        names = answer.get(key)
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise NotATesteeError(f"its answer to hello has no {key}, as a list of texts")
    return Hello(
        implementation=answer["implementation"],
        version=answer["version"],
        protocols=tuple(answer["protocols"]),
        operations=tuple(answer["operations"]),
    )
