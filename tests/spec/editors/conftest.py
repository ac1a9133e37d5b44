"""The YAML language server, running for the tests of a process."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import npm
from language_server import LanguageServer

HERE = Path(__file__).parent

# As docs/how-to/editors.md says: no catalogue of schemas from the network.
SETTINGS = {
    "yaml": {
        "schemaStore": {"enable": False},
        "validate": True,
        "completion": True,
        "hover": True,
        "yamlVersion": "1.2",
    }
}


@pytest.fixture(scope="session")
def node_modules() -> Path:
    """The folder with the server."""
    return npm.node_modules(HERE)


@pytest.fixture(scope="session")
def server(node_modules: Path) -> Iterator[LanguageServer]:
    """A language server without the network, set up as ``docs/how-to/editors.md`` says."""
    program = node_modules / "yaml-language-server" / "bin" / "yaml-language-server"
    with LanguageServer(program, "yaml", SETTINGS, before=HERE / "offline.cjs") as it:
        yield it
        assert it.messages == []
