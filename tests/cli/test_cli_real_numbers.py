"""``stagewire encode``, ``decode`` and ``show``: real numbers of IEEE 754 as decimals."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from pyarrow import parquet

if TYPE_CHECKING:
    from conftest import Stagewire

FIELDS = {
    "pid_consts_p": "0.65",
    "pid_consts_i": "2",
    "pid_consts_d": "1e-3",
    "pid_consts_dfc": "0x40a00000",
    "filter_fc": "500",
    "filter_q": "5.5",
    "notch_filter_on": "ENABLED",
    "pid_deriv_filter_on": "DISABLED",
}
NUMBERS = {
    "pid_consts_p": 0.65, "pid_consts_i": 2, "pid_consts_d": 0.001, "pid_consts_dfc": 5,
    "filter_fc": 500, "filter_q": 5.5,
}  # fmt: skip
OTHERS = ("laser_polarity=1", "rampup=0")
RAW = "70081e00d0010e006666263f000000406f12833a0000a0400000fa430000b04001000200"


def encoded(stagewire: Stagewire, **changed: str) -> tuple[int, str, str]:
    words = [f"{name}={value}" for name, value in (FIELDS | changed).items()]
    result = stagewire("encode", "QUAD_SET_LOOPPARAMS2", *words)
    return result.code, result.out.replace(" ", "").strip().lower(), result.err


def test_decimals_and_hex_patterns_are_encoded(stagewire: Stagewire) -> None:
    assert encoded(stagewire) == (0, RAW, "")


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("x", "filter_q must be a number such as 0.5 or 1e-9, or a bit pattern"),
        ("0.05", "filter_q must be 0.1 to 100, not 0.05"),
        ("-5", "filter_q must be 0.1 to 100, not -5"),
        ("nan", "filter_q must be 0.1 to 100, not nan"),
        ("1e99", "1e99 is too large for 4 bytes"),
        ("0x140000000", "the bit pattern 0x140000000 has more than 4 bytes"),
    ],
)
def test_wrong_numbers_are_refused(stagewire: Stagewire, value: str, said: str) -> None:
    code, out, error = encoded(stagewire, filter_q=value)
    assert (code, out) == (2, "")
    assert said in error


def test_a_table_shows_patterns_and_numbers(stagewire: Stagewire) -> None:
    rows = [line.split() for line in stagewire("decode", RAW).out.splitlines()]
    assert ["2", "pid_consts_p", "0x3f266666", "0.65"] in rows
    assert ["6", "pid_consts_i", "0x40000000", "2"] in rows


def test_json_has_numbers(stagewire: Stagewire) -> None:
    fields = json.loads(stagewire("decode", RAW, "--json").out)["fields"]
    assert NUMBERS.items() <= fields.items()


@pytest.mark.parametrize(
    ("pattern", "number"),
    [("0000c07f", "nan"), ("0000807f", "inf"), ("000080ff", "-inf"), ("cdcccc3d", 0.1)],
)
def test_numbers_that_json_lacks_are_text(
    stagewire: Stagewire, pattern: str, number: str | float
) -> None:
    written = stagewire(
        "encode", "LD_SET_MISCPARAMS", "wa_calib_factor=0x" + bytes.fromhex(pattern)[::-1].hex(),
        *OTHERS,
    )  # fmt: skip
    assert written.code == 0, written.err
    answer = stagewire("decode", written.out.strip(), "--json").out
    fields = json.loads(answer, parse_constant=pytest.fail)["fields"]
    assert fields["wa_calib_factor"] == number


def test_streams_have_numbers_in_every_format(stagewire: Stagewire, tmp_path: Path) -> None:
    file = tmp_path / "frames.hex"
    file.write_text(f"{RAW}\n{RAW}\n")
    stream = ("decode", file, "--end", "device")
    for line in stagewire(*stream).out.splitlines():
        assert " pid_consts_p=0.65 pid_consts_i=2 pid_consts_d=0.001 " in line
    for line in stagewire(*stream, "--json").out.splitlines():
        assert NUMBERS.items() <= json.loads(line)["fields"].items()
    for row in csv.DictReader(io.StringIO(stagewire(*stream, "--format", "csv").out)):
        assert NUMBERS.items() <= json.loads(row["fields"]).items()


def test_columns_of_one_message_have_numbers(stagewire: Stagewire, tmp_path: Path) -> None:
    file, table = tmp_path / "frames.hex", tmp_path / "frames.parquet"
    file.write_text(f"{RAW}\n{RAW}\n")
    typed = ("decode", file, "--end", "device", "--message", "QUAD_SET_LOOPPARAMS2")
    for row in csv.DictReader(io.StringIO(stagewire(*typed, "--format", "csv").out)):
        assert {name: float(row[name]) for name in NUMBERS} == NUMBERS
    assert stagewire(*typed, "--output", table).code == 0
    found = parquet.read_table(table)
    assert str(found.schema.field("pid_consts_p").type) == "double"
    assert found.column("pid_consts_p").to_pylist() == [0.65, 0.65]


def test_a_number_out_of_range_is_marked(stagewire: Stagewire) -> None:
    raw = RAW.replace("0000b040", "0000c842")  # 100, the largest
    assert "out of range" not in stagewire("decode", raw).out
    raw = RAW.replace("0000b040", "0000ca42")
    assert "101; out of range 0.1 to 100" in stagewire("decode", raw).out


def test_show_has_ranges_of_numbers(stagewire: Stagewire) -> None:
    shown = stagewire("show", "QUAD_SET_LOOPPARAMS2").out
    assert "0.1 to 100" in shown
    assert "real number; Q factor of the notch filter" in shown
    assert "1120403456" not in shown
