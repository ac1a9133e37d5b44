"""A client of a language server, which communicates with JSON-RPC over standard streams like an editor.

It implements the parts of the Language Server Protocol that the tests need: opening a text, diagnostics,
completion and hover.
"""

from __future__ import annotations

import json
import queue
import subprocess
import threading
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

PATIENCE = 60  # seconds for one answer of a busy machine


class LanguageServer:
    """A running server; use it in a ``with`` statement.

    :param program: script that Node.js runs.
    :param language: language of the files.
    :param settings: settings by section, sent when the server requests them.
    :param before: script that Node.js runs first.
    """

    def __init__(
        self,
        program: Path,
        language: str,
        settings: Mapping[str, Any],
        before: Path | None = None,
    ) -> None:
        self._command = ["node", *(["--require", str(before)] if before else []), str(program)]
        self._language = language
        self._settings = settings
        self._number = 0
        self._version = 0
        self._answers: dict[int, Any] = {}
        self._diagnostics: dict[str, list[dict[str, Any]]] = {}
        self._arrived: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self.messages: list[str] = []
        """Messages that the server showed or logged."""

    def __enter__(self) -> LanguageServer:
        command = [*self._command, "--stdio"]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        threading.Thread(target=self._read, daemon=True).start()
        capabilities = {
            "workspace": {"configuration": True},
            "textDocument": {
                "publishDiagnostics": {},
                "hover": {"contentFormat": ["markdown"]},
                "completion": {"completionItem": {"documentationFormat": ["markdown"]}},
            },
        }
        self._ask("initialize", processId=None, rootUri=None, capabilities=capabilities)
        self._tell("initialized")
        self._tell("workspace/didChangeConfiguration", settings=self._settings)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._process.terminate()
        self._process.communicate(timeout=PATIENCE)

    def open(self, path: Path, text: str | None = None) -> list[dict[str, Any]]:
        """Open a file, optionally with another text; return its diagnostics."""
        texts = {path: path.read_text(encoding="utf-8") if text is None else text}
        return self.open_all(texts)[path]

    def open_all(self, texts: Mapping[Path, str]) -> dict[Path, list[dict[str, Any]]]:
        """Open several files with these texts; return the diagnostics of each."""
        for path, text in texts.items():
            self._diagnostics.pop(path.as_uri(), None)
            self._version += 1  # the server caches its results by version
            document = {
                "uri": path.as_uri(),
                "languageId": self._language,
                "version": self._version,
            }
            self._tell("textDocument/didOpen", textDocument={**document, "text": text})
        return {path: self._wait(path) for path in texts}

    def close(self, *paths: Path) -> None:
        """Close files, and wait until the server clears their diagnostics."""
        for path in paths:
            self._diagnostics.pop(path.as_uri(), None)
            self._tell("textDocument/didClose", textDocument={"uri": path.as_uri()})
        for path in paths:
            assert self._wait(path) == []

    def completion(self, path: Path, line: int, character: int) -> dict[str, dict[str, Any]]:
        """Return the completion items at a position of an open file, by label."""
        answer = self._ask("textDocument/completion", **_place(path, line, character))
        return {item["label"]: item for item in answer["items"]}

    def hover(self, path: Path, line: int, character: int) -> str:
        """Return the hover text at a position of an open file."""
        answer = self._ask("textDocument/hover", **_place(path, line, character))
        return str(answer["contents"]["value"]) if answer else ""

    def _wait(self, path: Path) -> list[dict[str, Any]]:
        """Wait for the diagnostics of a file."""
        while path.as_uri() not in self._diagnostics:
            self._take()
        return self._diagnostics[path.as_uri()]

    def _ask(self, method: str, **params: Any) -> Any:
        self._number += 1
        number = self._number
        self._send({"id": number, "method": method, "params": params})
        while number not in self._answers:
            self._take()
        return self._answers.pop(number)

    def _tell(self, method: str, **params: Any) -> None:
        self._send({"method": method, "params": params})

    def _send(self, message: dict[str, Any]) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        assert self._process.stdin
        self._process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        self._process.stdin.flush()

    def _read(self) -> None:
        """Read the server's messages from its output, in a separate thread."""
        stream = self._process.stdout
        assert stream
        while True:
            length = 0
            while line := stream.readline().strip():
                name, _, value = line.partition(b":")
                if name.lower() == b"content-length":
                    length = int(value)
            if not length:
                self._arrived.put(None)
                return
            self._arrived.put(json.loads(stream.read(length)))

    def _take(self) -> None:
        """Wait for one message of the server and process it."""
        message = self._arrived.get(timeout=PATIENCE)
        if message is None:
            raise EOFError("the language server has ended")
        method, params = message.get("method"), message.get("params", {})
        if method is None:
            assert "error" not in message, message["error"]
            self._answers[message["id"]] = message.get("result")
        elif method == "textDocument/publishDiagnostics":
            self._diagnostics[params["uri"]] = params["diagnostics"]
        elif method in ("window/showMessage", "window/logMessage"):
            self.messages.append(params["message"])
        elif "id" in message:  # a request of the server
            result: Any = None
            if method == "workspace/configuration":
                result = [self._settings.get(item["section"]) for item in params["items"]]
            self._send({"id": message["id"], "result": result})


def _place(path: Path, line: int, character: int) -> dict[str, Any]:
    return {
        "textDocument": {"uri": path.as_uri()},
        "position": {"line": line, "character": character},
    }
