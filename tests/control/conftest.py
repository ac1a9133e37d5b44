"""A RunEngine, and the documents that it emits, each validated by the schemas of event-model."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest
from bluesky import RunEngine
from event_model import DocumentNames, schema_validators


class Documents(list[tuple[str, dict[str, Any]]]):
    """The documents of all runs, in order."""

    def of(self, name: str) -> list[dict[str, Any]]:
        """Return the documents of one kind."""
        return [document for kind, document in self if kind == name]

    @property
    def data(self) -> list[dict[str, Any]]:
        """The data of each event."""
        return [document["data"] for document in self.of("event")]

    def add(self, name: str, document: dict[str, Any]) -> None:
        """Add a document, unless it is invalid."""
        schema_validators[DocumentNames[name]].validate(document)
        self.append((name, document))


@pytest.fixture(scope="session", autouse=True)
def loop_of_plans() -> Iterator[RunEngine]:
    """One RunEngine, because the event loop of bluesky is one for the process."""
    engine = RunEngine({}, call_returns_result=True)
    yield engine
    loop = engine.loop
    loop.call_soon_threadsafe(loop.stop)
    engine._th.join()
    loop.run_until_complete(asyncio.sleep(0))
    loop.close()


@pytest.fixture
def documents() -> Documents:
    return Documents()


@pytest.fixture
def plans(loop_of_plans: RunEngine, documents: Documents) -> Iterator[RunEngine]:
    """The RunEngine, whose documents are validated."""
    token = loop_of_plans.subscribe(documents.add)
    yield loop_of_plans
    loop_of_plans.unsubscribe(token)
    if loop_of_plans.state != "idle":
        loop_of_plans.halt()
