"""Fuzz every kind of user input of the command, from a seed.

    python tests/fuzz/user_input.py                                # every target, one minute each
    python tests/fuzz/user_input.py --seconds 10 --seed 7 --target testee --target encode

The targets are the files of a spec (as text and as trees), the output folder, two specs or revisions to
compare, hex on the command line, captures in every format, fields, names, testee lines, benches, recordings
and faults of virtual controllers, PICS and expected failures, and whole command lines. ``conformance
examples`` reads only installed data, so only its options are fuzzed.

For any input, the command must not print a traceback or hang. It must exit with 0, 1 or 2, and write files
only where the case allows it (``sandbox.py``). Most cases run in this process through the entry point of the
command; one in a hundred runs as a separate process. Case ``n`` of a target depends only on the seed and on
``n``, so ``--first n --cases 1`` repeats it. A failure is minimised before it is shown.
"""

from __future__ import annotations

import argparse
import faulthandler
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from random import Random

import command_cases
import declared_cases
import diff_cases
import spec_cases
import virtual_cases
from sandbox import Case, Content, Sandbox, Wrong

TARGETS: dict[str, Callable[[Random], Case]] = {
    "spec-text": spec_cases.spec_text,
    "spec-tree": spec_cases.spec_tree,
    "manifest": spec_cases.manifest,
    "diff": diff_cases.diff,
    "hex": command_cases.decode_hex,
    "captures": command_cases.decode_file,
    "encode": command_cases.encode,
    "show": command_cases.show,
    "testee": command_cases.testee,
    "conformance": command_cases.conformance,
    "arguments": command_cases.arguments,
    "bench": virtual_cases.bench,
    "replay": virtual_cases.replay,
    "fault": virtual_cases.fault,
    "pics": declared_cases.pics,
    "expected": declared_cases.expected,
}
LIMIT = 5.0
"""Seconds after which a case counts as hanging."""
AS_PROCESS = 100
"""One case in this number runs as a separate process."""
_TRIES = 400
_SHOWN = 2000


class Failure(Exception):
    """A case in which the command failed, with everything needed to repeat it."""

    def __init__(self, target: str, seed: int, number: int, case: Case, wrong: Wrong) -> None:
        lines = [
            f"{target}, seed {seed}, case {number}: {wrong}",
            f"  repeat: user_input.py --target {target} --seed {seed} --first {number} --cases 1",
            f"  arguments: {list(case.arguments)}",
        ]
        if case.stdin:
            lines.append(f"  standard input: {_shown(case.stdin)}")
        for name, content in case.files.items():
            lines.append(f"  {name}: {_shown(content)}")
        super().__init__("\n".join(lines))


def _shown(content: Content) -> str:
    text = repr(content)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}… ({len(text)} characters)"


def case_of(target: str, seed: int, number: int) -> Case:
    """Return one case of a target."""
    return TARGETS[target](Random(f"{target} {seed} {number}"))


def fuzz(
    sandbox: Sandbox,
    target: str,
    seed: int,
    *,
    first: int = 0,
    cases: int | None = None,
    seconds: float | None = None,
    as_process: int = AS_PROCESS,
) -> Counter[int]:
    """Run cases of a target, up to a number or a time; return the count of each exit status.

    Raises :class:`Failure` at the first case that fails.
    """
    codes: Counter[int] = Counter()
    began = time.monotonic()
    for number in count(first):
        if cases is not None and number - first >= cases:
            break
        if seconds is not None and time.monotonic() - began >= seconds:
            break
        case = case_of(target, seed, number)
        apart = bool(as_process) and number % as_process == as_process - 1
        try:
            codes[sandbox.run(case, as_process=apart).code] += 1
        except Wrong as wrong:
            least, last = smaller(sandbox, case, wrong)
            raise Failure(target, seed, number, least, last) from wrong
    return codes


# Minimising a failure


def smaller(sandbox: Sandbox, case: Case, wrong: Wrong) -> tuple[Case, Wrong]:
    """Return a smaller case that fails in the same way, after a few hundred attempts."""
    tries = count()

    def fails(candidate: Case) -> Wrong | None:
        if next(tries) >= _TRIES:
            return None
        try:
            sandbox.run(candidate)
        except Wrong as found:
            return found if _kind(found) == _kind(wrong) else None
        return None

    for name in list(case.files):
        rest = {other: content for other, content in case.files.items() if other != name}
        if found := fails(replace(case, files=rest)):
            case, wrong = replace(case, files=rest), found
    for name in ("", *(name for name, content in case.files.items() if isinstance(content, bytes))):
        size = max(1, len(_content(case, name)) // 2)
        while size:
            position = 0
            while position < len(data := _content(case, name)):
                candidate = _with(case, name, data[:position] + data[position + size :])
                if found := fails(candidate):
                    case, wrong = candidate, found
                else:
                    position += size
            size //= 2
    for at in range(len(case.arguments) - 1, 0, -1):
        candidate = replace(case, arguments=case.arguments[:at] + case.arguments[at + 1 :])
        if found := fails(candidate):
            case, wrong = candidate, found
    return case, wrong


def _kind(wrong: Wrong) -> str:
    """Return the part of a message that identifies the kind of failure."""
    return str(wrong)[:25]


def _content(case: Case, name: str) -> bytes:
    content = case.files[name] if name else case.stdin
    return content if isinstance(content, bytes) else b""


def _with(case: Case, name: str, data: bytes) -> Case:
    return replace(case, files={**case.files, name: data}) if name else replace(case, stdin=data)


def main() -> int:
    """Fuzz the targets one after the other; return 1 if one failed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="seconds for each target")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--target", action="append", choices=TARGETS)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--cases", type=int, help="number of cases, instead of a time")
    given = parser.parse_args()
    seconds = None if given.cases else given.seconds
    failed = False
    for target in given.target or TARGETS:
        # In case no signal ends the run.
        faulthandler.dump_traceback_later((seconds or 3600) + 60, exit=True)
        with tempfile.TemporaryDirectory() as root:
            sandbox = Sandbox(Path(root), LIMIT)
            try:
                codes = fuzz(
                    sandbox, target, given.seed,
                    first=given.first, cases=given.cases, seconds=seconds,
                )  # fmt: skip
            except Failure as failure:
                failed = True
                print(failure, flush=True)
                continue
        listed = ", ".join(f"exit {code}: {number:,}" for code, number in sorted(codes.items()))
        print(f"{target}: {codes.total():,} cases, {listed}", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
