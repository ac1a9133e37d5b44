"""``stagewire encode``: values in the notations of users, all of which are checked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from conftest import Stagewire


@pytest.mark.parametrize(
    ("arguments", "raw"),
    [
        (
            "MOT_MOVE_ABSOLUTE --form data chan_ident=1 absolute_distance=200000",
            "53 04 06 00 D0 01 01 00 40 0D 03 00",
        ),
        (
            "mot_move_absolute --form data chan_ident=CHAN1 absolute_distance=-1 --dest 0x22",
            "53 04 06 00 A2 01 01 00 FF FF FF FF",
        ),
        ("MOT_MOVE_ABSOLUTE --form header chan_ident=0x01", "53 04 01 00 50 01"),
        ("MOD_IDENTIFY", "23 02 00 00 50 01"),
        ("MOD_IDENTIFY param2=7", "23 02 00 07 50 01"),
        ("MOT_MOVE_COMPLETED --form header chan_ident=1", "64 04 01 00 01 50"),
        (
            "MOT_MOVE_COMPLETED --form data:dc chan_ident=1 position=0 velocity=0 "
            "status_bits=settled|channel_enabled --dest 1 --source 0x21",
            "64 04 0E 00 81 21 01 00 00 00 00 00 00 00 00 00 00 20 00 80",
        ),
        ("MOT_MOVE_JOG chan_ident=chan1 direction=Reverse", "6A 04 01 02 50 01"),
        (
            "MOT_MOVE_JOG chan_ident=1 direction=3",
            "6A 04 01 03 50 01",
        ),  # raw values are not checked against enumerations, as in the codec
        (
            "MOT_SET_AVMODES chan_ident=1 mode_bits=LEDMODE_IDENT|ledmode_moving",
            "B3 04 04 00 D0 01 01 00 09 00",
        ),
        (
            "MOT_SET_LIMSWITCHPARAMS chan_ident=1 cw_hard_limit=makes|SWAPPED ccw_hard_limit=BREAKS "
            "cw_soft_limit=0 ccw_soft_limit=0 software_limit_mode=ignore",
            "23 04 10 00 D0 01 01 00 82 00 03 00 00 00 00 00 00 00 00 00 01 00",
        ),
        (
            "MOT_MOVE_ABSOLUTE --form data chan_ident=1 absolute_distance=0 extra=beef",
            "53 04 08 00 D0 01 01 00 00 00 00 00 BE EF",
        ),
    ],
)
def test_a_message_is_encoded(stagewire: Stagewire, arguments: str, raw: str) -> None:
    result = stagewire("encode", *arguments.split())
    assert (result.code, result.out) == (0, f"{raw}\n"), result.err


def test_an_encoded_message_can_be_decoded(stagewire: Stagewire) -> None:
    result = stagewire(
        "encode", "HW_GET_INFO", "serial_number=83000001", "model_number=TDC001", "type=44",
        "software_version=01 02 03 00", "notes=T-Cube µ", "hw_version=1", "mod_state=0",
        "nchs=1",
    )  # fmt: skip
    assert result.code == 0, result.err
    decoded = stagewire("decode", result.out.strip())
    assert "TDC001" in decoded.out
    assert "01020300" in decoded.out
    assert "T-Cube µ" in decoded.out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("", "Missing argument"),
        ("MOT_MOVE_ABSOLUT", "did you mean MOT_MOVE_ABSOLUTE"),
        ("MOT_MOVE_ABSOLUTE chan_ident=1", "has several forms; choose one of header, data"),
        ("MOT_MOVE_ABSOLUTE --form dat", "has no form dat"),
        ("MOT_MOVE_HOME", "lacks chan_ident"),
        ("MOT_MOVE_HOME chan_ident", "'chan_ident' is not FIELD=VALUE"),
        ("MOT_MOVE_HOME chan_ident=1 chan_ident=2", "chan_ident is given more than once"),
        ("MOT_MOVE_HOME channel=1", "has no field channel"),
        ("MOT_MOVE_HOME chan_ident=CHAN9", "chan_ident 'CHAN9' is not one of CHAN1, CHAN2, nor"),
        ("MOT_MOVE_JOG chan_ident=1 direction=forwards", "is not one of FORWARD, REVERSE, nor an"),
        ("MOT_MOVE_JOG chan_ident=1 direction=FORWARD|REVERSE", "is not one of FORWARD, REVERSE"),
        ("MOT_MOVE_HOME chan_ident=256", "chan_ident must be 0 to 255 (raw counts), not 256"),
        ("MOT_MOVE_HOME chan_ident=1.5", "nor an integer such as 5 or 0x05"),
        ("MOT_MOVE_HOME chan_ident=1 --dest 0x80", "dest must be an address from 0 to 0x7f"),
        ("MOT_MOVE_HOME chan_ident=1 --source bay", "--source must be an address such as 0x50"),
        ("MOT_MOVE_HOME chan_ident=1 data=00", "takes fields, not data"),
        ("MOT_SET_MOVEVELPARAMS", "cannot be used"),
    ],
)
def test_wrong_arguments_are_refused(stagewire: Stagewire, arguments: str, said: str) -> None:
    result = stagewire("encode", *arguments.split())
    assert (result.code, result.out) == (2, "")
    assert said in result.err
