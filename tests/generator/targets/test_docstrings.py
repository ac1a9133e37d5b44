"""Docstrings of generated classes: meaning, fields and errata."""

from __future__ import annotations

import ast

import pytest

DOCSTRINGS = {
    "PosSetVelParams": """\
Sets the velocity parameters.

Speed of the next move.

``POS_SET_VELPARAMS`` (0x0101), to the controller, 14 bytes of data; page 4.

Kept until the device is switched off.

:param chan_ident: :class:`~.Channel`; from 0 to 65535; default 1.
:param min_velocity: always zero at present; in counts; scale to mm/s depends on the stage; from
    0 to 1000; default 0.
:param max_velocity: in counts; scale to mm/s depends on the stage; from 0 to 4294967295.
:param wait: in counts of 512/5 us; from -32768 to 32767.
:param marker: always 0x1234.""",
    "PosReqVelParams": """\
Requests the velocity parameters.

``POS_REQ_VELPARAMS`` (0x0102), to the controller, header only; page 4. Answered by
``POS_GET_VELPARAMS``.

:param chan_ident: :class:`~.Channel`; from 0 to 255.""",
    "PosMoveHeader": """\
Moves to a position.

``POS_MOVE`` (0x0120), to the controller, header only; page 4. Completes with ``POS_MOVED``.
Muted by ``POS_ALIVE``.

Not without a slide.

To the stored position.

:param chan_ident: :class:`~.Channel`; from 0 to 255.

Erratum ``tiny-move-length`` (MSG_POS_MOVE, byte table): printed 08; encoded 06.""",
    "PosMovedHeader": """\
Reports that the target is reached.

``POS_MOVED`` (0x0121), to the host, header only; pages 5, 6.

:param chan_ident: from 0 to 255.
:param param2: always 0x07.""",
    "PosMovedServo": """\
Reports that the target is reached.

``POS_MOVED`` (0x0121), to the host, 14 bytes of data; pages 5, 6. This layout is used if status
is servo.

With a servo.

:param chan_ident: :class:`~.Channel`; from 0 to 65535.
:param position: in counts; scale to mm depends on the stage; from -2147483648 to 2147483647.
:param velocity: in counts; scale to mm/s depends on the stage; from 0 to 65535.
:param reserved: reserved, sent as zero.
:param status_bits: :class:`~.StateBits`; from 0 to 4294967295.""",
    "PosMovedCoil": """\
Reports that the target is reached.

``POS_MOVED`` (0x0121), to the host, 14 bytes of data; pages 5, 6. This layout is used if status
is coil.

:param chan_ident: :class:`~.Channel`; from 0 to 65535.
:param position: from -2147483648 to 2147483647.
:param encoder_count: in counts; unit and scale depend on display_mode; from -2147483648 to
    2147483647.
:param status_bits: :class:`~.CoilBits`; from 0 to 4294967295.""",
    "PosMovedUndecided": """\
``POS_MOVED`` (0x0121) with an unknown layout; page 5.

Reports that the target is reached. The layout depends on the controller (status servo or status
coil), and the bytes do not show which one it is. The fields that all layouts share can be read.
Encoding writes ``data`` unchanged.""",
    "PosEcho": """\
Returns the received data.

``POS_ECHO`` (0x0122), in both directions, 16 bytes of data; page 6.

:param label: text of at most 8 characters.
:param blob: 6 bytes.
:param load: in counts; scale to percent depends on maximum_volts; from 0 to 65535.""",
    "Lamp": """\
Switches the lamp.

``LAMP`` (0x0201), to the controller, 4 bytes of data; page 7.

:param sample_time: in counts; scale to ms depends on the unit; from 0 to 65535.
:param force: in counts; scale to Pa unknown; from 0 to 65535.""",
    "LampTest": """\
Named, but not described.

``LAMP_TEST`` (0x0202), to the controller, layout not documented; page 7.

Erratum ``tiny-lamp-test`` (MSG_LAMP_TEST and MSG_LAMP_BROKEN): printed the names; encoded
    messages without a layout.""",
}


COMMANDS = {
    "Wake": """\
Wakes the turtle.

``WAKE`` (0xFE 0x57), two bytes; section Setup. Typed as ``W`` after the prefix.

It never snaps.

Firmware 1.3: At once.""",
    "GoTo": """\
Walks to a place.

``GO_TO`` (0x47), 6 bytes of data, size 6; section Go to. Typed as ``G``. Stops ``HALT``.

Slowly.

Two numbers.

:param place: in counts, 10 per um; from -8388608 to 8388607.
:param height: from 0 to 1000.

Erratum ``turtle-height`` (The least height): printed 1; encoded 0.""",
    "Mood": """\
Requests the mood.

``MOOD`` (0x3F), no data, no size slot; section Mood. Typed as ``?``.""",
    "MoodReply": """\
Reply to ``MOOD``, 1 byte.

A reply has no frame. Its meaning depends on the command that was sent.

:param mood: :class:`~.Feeling`; from 0 to 255.""",
    "WhereReply": """\
Reply to ``WHERE``, 7 bytes.

A reply has no frame. Its meaning depends on the command that was sent.

Place, height and eyes.

:param place: of the nose; in counts, 10 per um; from -8388608 to 8388607.
:param height: from 0 to 16777215.
:param eyes_wide: :class:`~.Eyes`; from 0 to 255.""",
    "Spin": """\
Spins.

``SPIN`` (0x53), 2 bytes of data, size 2; section Spin (about). Typed as ``S``.

A dummy function: refused unless ``allow_dummy`` is given.

:param turns: from -32768 to 32767; default 1.

Erratum ``turtle-spin-byte`` (Spin, the byte in hexadecimal): printed 0x35; encoded 0x53.""",
    "Name": """\
Sets the name, and returns the old one.

``NAME`` (0x4E), 4 bytes of data, size 4; section Name. Typed as ``N``.

Firmware 1.5: Names may be long.

:param name: text of at most 3 characters.
:param spare: reserved, sent as zero.""",
    "Halt": """\
Stops immediately.

``HALT`` (0x48), no data, size 0; section Halt. Typed as ``H``.

Erratum ``turtle-stop`` (Halt, its other name): printed Stop; encoded Halt.""",
}


def docstring(files: dict[str, str], name: str) -> str | None:
    modules = [
        text for path, text in files.items() if "/messages/" in path and path.endswith(".py")
    ]
    [found] = [
        node
        for text in modules
        for node in ast.parse(text).body
        if isinstance(node, ast.ClassDef) and node.name == name
    ]
    return ast.get_docstring(found)


@pytest.mark.parametrize("name", DOCSTRINGS)
def test_docstring(files: dict[str, str], name: str) -> None:
    assert docstring(files, name) == DOCSTRINGS[name]


@pytest.mark.parametrize("name", COMMANDS)
def test_docstring_of_a_command(command_files: dict[str, str], name: str) -> None:
    assert docstring(command_files, name) == COMMANDS[name]
