"""Appending bytes to a frame: mistakes of the caller are errors, and nothing is written past the buffer."""

from __future__ import annotations

from pathlib import Path

import pytest
from toolchain import C_WARNINGS, C, compiles, need, run

PROGRAM = """
#include "stagewire_apt/messages/motor.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* append SIZE CAP EXTRA: prints the status, the size and the length in the header. */
int main(int argc, char **argv)
{
    static const uint8_t extra[300] = {1};
    const apt_mot_get_dcstatusupdate message = APT_MOT_GET_DCSTATUSUPDATE_INIT;
    const size_t cap = (size_t)atoi(argv[argc - 2]);
    size_t size = (size_t)atoi(argv[argc - 3]);
    uint8_t frame[APT_MOT_GET_DCSTATUSUPDATE_SIZE];
    uint8_t *room = calloc(1U, cap + 1U); /* one more, so that there always is some */
    apt_status status;

    if (room == NULL
        || apt_mot_get_dcstatusupdate_encode(&message, apt_to_host(0x50), frame, sizeof frame)) {
        return 1;
    }
    memcpy(room, frame, cap < sizeof frame ? cap : sizeof frame);
    status = apt_append_extra(extra, (size_t)atoi(argv[argc - 1]), room, &size, cap);
    printf("%d %u %u\\n", (int)status, (unsigned)size, cap > 2U ? room[2] : 0U);
    free(room);
    return 0;
}
"""
OK, WRONG_LENGTH, OUT_OF_RANGE, NO_SPACE = 0, 4, 5, 6


@pytest.fixture(scope="module")
def append(tmp_path_factory: pytest.TempPathFactory) -> Path:
    need("gcc")
    folder = tmp_path_factory.mktemp("append")
    source, program = folder / "append.c", folder / "append"
    source.write_text(PROGRAM, encoding="ascii")
    sanitized = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    compiles("gcc", "-std=c99", *C_WARNINGS, *sanitized, f"-I{C}", source, "-o", program)
    return program


@pytest.mark.parametrize(
    ("size", "cap", "extra", "status", "after"),
    [
        (20, 24, 4, OK, 24),
        (20, 261, 241, OK, 261),
        (20, 20, 0, OK, 20),
        (20, 23, 4, NO_SPACE, 20),
        (20, 300, 242, OUT_OF_RANGE, 20),
        # Frames that no encoder produces:
        (20, 10, 4, NO_SPACE, 20),
        (24, 20, 0, NO_SPACE, 24),
        (5, 20, 4, WRONG_LENGTH, 5),
        (0, 0, 4, WRONG_LENGTH, 0),
        (262, 300, 0, OUT_OF_RANGE, 262),
    ],
)
def test_nothing_is_written_past_the_buffer(
    append: Path, size: int, cap: int, extra: int, status: int, after: int
) -> None:
    length = after - 6 if status == OK else 14 if cap > 2 else 0
    done = run(append, size, cap, extra)
    assert (done.returncode, done.stdout) == (0, f"{status} {after} {length}\n")
