"""A running YAML language server, shared by the tests of a process."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import npm
from language_server import LanguageServer

HERE = Path(__file__).parent

# As in docs/how-to/editors.md: do not load a schema catalogue from the network.
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
    """Return the folder with the server."""
    return npm.node_modules(HERE)


@pytest.fixture(scope="session")
def server(node_modules: Path) -> Iterator[LanguageServer]:
    """Run a language server without network access, configured as in ``docs/how-to/editors.md``."""
    program = node_modules / "yaml-language-server" / "bin" / "yaml-language-server"
    with LanguageServer(program, "yaml", SETTINGS, before=HERE / "offline.cjs") as it:
        yield it
        assert it.messages == []
