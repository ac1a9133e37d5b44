"""Shell completion: the shells themselves are asked to complete a line."""

from __future__ import annotations

import os
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="requires POSIX shells")

LINES = {
    "stagewire mon": "monitor",
    "stagewire conformance dev": "device",
    "stagewire move virtual://TDC": "virtual://TDC001",
    "stagewire move virtual://TDC001 --stag": "--stage --stages",
    "stagewire move virtual://TDC001 --stage LTS150": "LTS150 LTS150C",
    "stagewire monitor --unit tst": "tst001 tst101",
    "stagewire show mot_move_abs": "mot_move_absolute",
    "stagewire encode MOT_MOVE_ABS": "MOT_MOVE_ABSOLUTE",
    "stagewire decode --command READ_MOTOR_P": "READ_MOTOR_POSITION READ_MOTOR_POSITION_AND_STATUS",
}
"""A line -> the words that complete its last one."""
BASH = """\
eval "$(stagewire completion bash)"
COMP_LINE=$1 COMP_POINT=${#1}
_stagewire_completion stagewire
echo "${COMPREPLY[@]}"
"""
ENVIRONMENT = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}


def asked(*words: str) -> str:
    return subprocess.run(
        words, env=ENVIRONMENT, capture_output=True, text=True, timeout=60, check=True
    ).stdout


@pytest.mark.parametrize(("line", "words"), LINES.items())
def test_bash_completes_a_line(line: str, words: str) -> None:
    replaced = words.rpartition(":")[2] if ":" in line else words  # bash splits words at colons
    assert asked("bash", "-c", BASH, "bash", line).split() == replaced.split()


def test_bash_completes_after_an_equals_sign() -> None:
    assert asked("bash", "-c", BASH, "bash", "stagewire move --unit=TDC") == "TDC001\n"


@pytest.mark.skipif(shutil.which("fish") is None, reason="requires fish")
def test_fish_completes_all_lines(tmp_path: Path) -> None:
    (tmp_path / "lines.fish").write_text(
        "stagewire completion fish | source\n"
        + "".join(
            f'echo (complete -C "{line}" | string replace -r "\\t.*" "")\n' for line in LINES
        ),
        encoding="utf-8",
    )
    found = asked("fish", "--no-config", str(tmp_path / "lines.fish")).splitlines()
    assert dict(zip(LINES, found, strict=True)) == LINES


@pytest.mark.skipif(shutil.which("zsh") is None, reason="requires zsh")
def test_zsh_completes_a_url() -> None:
    """Zsh completes only on a terminal."""
    import pty

    terminal, inner = pty.openpty()
    shell = subprocess.Popen(
        ["zsh", "-f", "-i"],
        stdin=inner,
        stdout=inner,
        stderr=inner,
        start_new_session=True,
        env={**ENVIRONMENT, "TERM": "dumb", "PS1": "> "},
    )
    os.close(inner)
    try:
        setup = 'autoload -U compinit; compinit -u -D; eval "$(stagewire completion zsh)"'
        os.write(terminal, f"{setup}; echo re''ady\n".encode())
        assert "ready" in _until(terminal, "ready")
        os.write(terminal, b"stagewire move virtual://TDC\t")
        assert "virtual://TDC001 " in _until(terminal, "virtual://TDC001 ")
    finally:
        shell.kill()
        shell.wait()
        os.close(terminal)


def _until(terminal: int, wanted: str) -> str:
    """Return what a terminal shows, once it shows a text or after half a minute."""
    shown = ""
    deadline = time.monotonic() + 30
    while wanted not in shown and (left := deadline - time.monotonic()) > 0:
        if select.select([terminal], [], [], left)[0]:
            shown += os.read(terminal, 65536).decode(errors="replace")
    return shown


@pytest.mark.parametrize("words", ["stagewire move 'virtual://TD", "stagewire move --stage 'LTS15"])
def test_a_word_with_an_open_quote_is_completed(words: str) -> None:
    assert asked("bash", "-c", BASH, "bash", words).strip()
