"""Run the command in an isolated folder, and watch its effects.

A :class:`Case` consists of a command line, standard input, and the files in the working folder. It runs in
this process through the entry point of the command (``stagewire_cli.main.main``), or as a real process.
Either way it must end within the time limit, with a documented exit status and without a traceback, and may
write only below the folder that the case allows.

In this process, a Python audit hook intercepts every opening of a file for writing, every creation, renaming
and removal of a file, every new process and every connection. In addition, and for real processes, the whole
sandbox is listed before and after the run.
"""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unicodedata
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import metadata
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

import typer

import stagewire_cli.main

_PROCESS = [sys.executable, "-c", "from stagewire_cli.main import run; run()"]


class Wrong(AssertionError):
    """The error of a case in which the command misbehaved."""


class _Hang(BaseException):
    """The time limit has passed. A base exception, so that no handler of the command catches it."""


class _Escape(BaseException):
    """The command is about to do something forbidden."""


@dataclass(frozen=True)
class Link:
    """A symbolic link in place of a file."""

    target: str


Content = bytes | Link | None
"""Content of a file. None removes a file of the base."""


@dataclass(frozen=True)
class Ran:
    """Result of a run of the command."""

    code: int
    out: bytes
    err: bytes
    folder: Path


def _nothing(case: Case, ran: Ran) -> None:
    """Check nothing beyond the rules for every command."""


@dataclass(frozen=True)
class Case:
    """One run of the command.

    :param arguments: command-line arguments.
    :param stdin: content of standard input.
    :param files: path below the working folder -> content.
    :param base: folder to copy to the path ``spec`` first.
    :param may_write: the only folder below the working folder that the command may write to. Temporary
        files are also allowed in the folder for them.
    :param may_start: programs that the command may run.
    :param may_listen: whether the command may listen for connections from this machine.
    :param holds: raises :class:`Wrong` unless the result is correct.
    """

    arguments: tuple[str, ...]
    stdin: bytes = b""
    files: Mapping[str, Content] = field(default_factory=dict)
    base: Path | None = None
    may_write: str = ""
    may_start: tuple[str, ...] = ()
    may_listen: bool = False
    holds: Callable[[Case, Ran], None] = _nothing


class Sandbox:
    """A folder with a working folder, a home folder and a folder for temporary files.

    :param root: an empty folder for this sandbox.
    :param seconds: time limit of a run.
    """

    def __init__(self, root: Path, seconds: float) -> None:
        self.root = Path(os.path.realpath(root))
        self.seconds = seconds
        self.work = self.root / "work"
        for name in ("home", "tmp", "precious"):
            (self.root / name).mkdir()
        (self.root / "precious" / "file.txt").write_text("somebody else's\n", encoding="utf-8")
        self._environment = {"HOME": str(self.root / "home"), "TMPDIR": str(self.root / "tmp")}

    def run(self, case: Case, *, as_process: bool = False) -> Ran:
        """Run a case; raise :class:`Wrong` if the command misbehaves."""
        self._prepare(case)
        allowed = self.work / case.may_write if case.may_write else None
        before = self._listing(allowed)
        ran = self._as_process(case) if as_process else self._here(case, allowed)
        _check_end(case, ran)
        after = self._listing(allowed)
        if before != after:
            changed = sorted(str(p) for p, _ in before.items() ^ after.items())
            raise Wrong(f"files changed outside the allowed folder: {', '.join(changed)}")
        try:
            case.holds(case, ran)
        except (ValueError, KeyError, TypeError, OSError) as error:
            raise Wrong(f"cannot read the result: {error}") from error
        return ran

    def _prepare(self, case: Case) -> None:
        shutil.rmtree(self.work, ignore_errors=True)
        self.work.mkdir()
        if case.base is not None:
            shutil.copytree(case.base, self.work / "spec")
        for name, content in case.files.items():
            path = self.work / name
            if content is None:
                path.unlink(missing_ok=True)
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            if isinstance(content, Link):
                path.symlink_to(content.target)
            else:
                path.write_bytes(content)

    def _listing(self, allowed: Path | None) -> dict[Path, tuple[int, int]]:
        """Return the content of the sandbox, except the folder that may be written to."""
        listed = {}
        for folder, names, files in os.walk(self.root):
            here = Path(folder)
            if allowed is not None:
                names[:] = [name for name in names if here / name != allowed]
            for name in (*names, *files):
                state = os.lstat(here / name)
                # ignore the times of folders: writing to the allowed folder can change them
                listed[here / name] = (
                    (state.st_size, state.st_mtime_ns) if name in files else (0, 0)
                )
        return listed

    def _as_process(self, case: Case) -> Ran:
        environment = {**os.environ, **self._environment, "PYTHONDONTWRITEBYTECODE": "1"}
        arguments = [os.fsencode(argument) for argument in case.arguments]
        try:
            ended = subprocess.run(
                [*_PROCESS, *arguments],
                cwd=self.work,
                env=environment,
                input=case.stdin,
                capture_output=True,
                timeout=self.seconds + 10,  # time to start Python on a busy machine
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise Wrong(f"still running after {self.seconds} s") from None
        return Ran(ended.returncode, ended.stdout, ended.stderr, self.work)

    def _here(self, case: Case, allowed: Path | None) -> Ran:
        out, err = io.BytesIO(), io.BytesIO()
        streams = (
            io.TextIOWrapper(io.BytesIO(case.stdin), encoding="utf-8"),
            io.TextIOWrapper(out, encoding="utf-8", write_through=True),
            io.TextIOWrapper(err, encoding="utf-8", write_through=True),
        )
        made = _command()
        with contextlib.ExitStack() as stack:
            stack.enter_context(_replaced(sys, dict(zip(_STREAMS, streams, strict=True))))
            stack.enter_context(_replaced(sys, {"dont_write_bytecode": True}))
            stack.enter_context(_replaced(tempfile, {"tempdir": str(self.root / "tmp")}))
            # Creating these two for every case would take longer than most cases.
            stack.enter_context(_replaced(stagewire_cli.main, {"command": lambda _: made}))
            stack.enter_context(_replaced(metadata, {"entry_points": _entry_points}))
            stack.enter_context(_environment(self._environment))
            stack.enter_context(contextlib.chdir(self.work))
            watch = _Watch([self.root / "tmp", *([allowed] if allowed else [])], case)
            stack.enter_context(_replaced(sys.modules[__name__], {"_watch": watch}))
            stack.enter_context(_limited(self.seconds))
            try:
                code = stagewire_cli.main.main(list(case.arguments))
            except _Hang:
                raise Wrong(f"still running after {self.seconds} s") from None
            except _Escape:
                code = 0
            except BaseException as error:
                raise Wrong(f"{type(error).__name__}: {error}") from error
            for stream in streams[1:]:
                stream.flush()
        if watch.escapes:
            raise Wrong(f"the command attempted a forbidden operation: {', '.join(watch.escapes)}")
        return Ran(code, out.getvalue(), err.getvalue(), self.work)


_STREAMS = ("stdin", "stdout", "stderr")
_entry_points = cache(metadata.entry_points)


@cache
def _command() -> Any:
    return typer.main.get_command(stagewire_cli.main.command())


# Categories of characters that a terminal does not print.
_STEERING = ("Cc", "Cf", "Cs", "Zl", "Zp")


def _check_end(case: Case, ran: Ran) -> None:
    if ran.code not in (0, 1, 2):
        raise Wrong(f"exit status {ran.code}: {ran.err[-500:]!r}")
    for name, said in (("output", ran.out), ("error", ran.err)):
        if b"Traceback (most recent call last)" in said:
            raise Wrong(f"a traceback on standard {name}: {said[-2000:].decode(errors='replace')}")
        try:
            text = said.decode("utf-8").replace("\r\n", "\n")  # CSV lines end with CR LF
        except UnicodeDecodeError as error:
            raise Wrong(f"standard {name} is not UTF-8: {error}") from None
        known = {"\n", "\t", *"".join(case.arguments)}  # arguments are echoed unchanged
        steering = {c for c in set(text) - known if unicodedata.category(c) in _STEERING}
        if steering:
            raise Wrong(f"standard {name} holds {sorted(steering)}, which can control a terminal")
    if ran.code == 2 and not ran.err.strip():
        raise Wrong("exit status 2 without a message on standard error")
    if ran.code == 1 and not (ran.out.strip() or ran.err.strip()):
        raise Wrong("exit status 1 without a message")


@contextlib.contextmanager
def _replaced(owner: Any, attributes: Mapping[str, Any]) -> Iterator[None]:
    saved = {name: getattr(owner, name) for name in attributes}
    for name, value in attributes.items():
        setattr(owner, name, value)
    try:
        yield
    finally:
        for name, value in saved.items():
            setattr(owner, name, value)


@contextlib.contextmanager
def _environment(changes: Mapping[str, str]) -> Iterator[None]:
    saved = dict(os.environ)
    os.environ.update(changes)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(saved)


@contextlib.contextmanager
def _limited(seconds: float) -> Iterator[None]:
    def hang(number: int, frame: FrameType | None) -> NoReturn:
        raise _Hang

    saved = signal.signal(signal.SIGALRM, hang)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, saved)


# The watch. An audit hook cannot be removed, so it checks a module variable.

_TO_WRITE = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_HERE = ("127.0.0.1", "::1")
_PATHS = {  # event -> indexes of the changed path and of the folder descriptor it is relative to
    "os.chmod": ((0, 2),), "os.chown": ((0, 3),), "os.link": ((1, 3),), "os.mkdir": ((0, 2),),
    "os.remove": ((0, 1),), "os.rename": ((0, 2), (1, 3)), "os.rmdir": ((0, 1),),
    "os.symlink": ((1, 2),), "os.truncate": ((0, None),), "os.utime": ((0, 3),),
}  # fmt: skip
_NEVER = frozenset({
    "subprocess.Popen", "os.system", "os.exec", "os.fork", "os.posix_spawn", "os.spawn",
    "socket.connect", "socket.bind",
})  # fmt: skip


class _Watch:
    """The operations that a case may perform, and the forbidden ones that it attempted."""

    def __init__(self, folders: list[Path], case: Case) -> None:
        self.folders = folders
        self.case = case
        self.escapes: list[str] = []

    def see(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Check one event before it happens; end the run if it is forbidden."""
        if event in _NEVER and not self._may(event, arguments):
            self._end(f"{event} {', '.join(map(str, arguments[:2]))}")
        for path in _changed(event, arguments):
            inside = any(Path(path).is_relative_to(folder) for folder in self.folders)
            if not inside and path != os.devnull:
                self._end(f"{event} {path}")

    def _may(self, event: str, arguments: tuple[Any, ...]) -> bool:
        if event == "subprocess.Popen":
            return str(arguments[0]) in self.case.may_start
        return event == "socket.bind" and self.case.may_listen and arguments[1][0] in _HERE

    def _end(self, what: str) -> NoReturn:
        self.escapes.append(what)
        raise _Escape


def _changed(event: str, arguments: tuple[Any, ...]) -> Iterator[str]:
    """Yield the real paths that an event is about to change."""
    if event == "open":
        name, _, flags = arguments
        if isinstance(name, (str, bytes, os.PathLike)) and flags & _TO_WRITE:
            yield os.path.realpath(os.fsdecode(name))
    for at, begins in _PATHS.get(event, ()):
        if isinstance(arguments[at], int):  # an open file was already checked when it was opened
            continue
        # the last component itself changes, even if it is a link
        folder, name = os.path.split(os.fsdecode(arguments[at]))
        descriptor = -1 if begins is None else arguments[begins]
        if descriptor != -1:
            opened = f"/proc/self/fd/{descriptor}"
            if not os.path.exists(opened):  # not on this system; the listing still detects it
                continue
            folder = os.path.join(os.path.realpath(opened), folder)
        yield os.path.join(os.path.realpath(folder), name)


_watch: _Watch | None = None


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if _watch is not None and (event == "open" or event in _PATHS or event in _NEVER):
        _watch.see(event, arguments)


sys.addaudithook(_audit)
