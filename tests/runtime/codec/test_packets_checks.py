"""Checks of packets, compared with published values, the standard library and their definitions."""

from __future__ import annotations

import binascii
import copy
import pickle

import pytest
from framing_references import reference_check
from hypothesis import given
from hypothesis import strategies as st

from stagewire.protocols import Check, Crc, Sum, Xor

DIGITS = b"123456789"

# name in the catalogue of parametrised CRC algorithms: size, polynomial, initial, reflected, final, check
CATALOGUE = {
    "CRC-8/SMBUS": (1, 0x07, 0x00, False, 0x00, 0xF4),
    "CRC-8/MAXIM-DOW": (1, 0x31, 0x00, True, 0x00, 0xA1),
    "CRC-16/IBM-3740": (2, 0x1021, 0xFFFF, False, 0x0000, 0x29B1),
    "CRC-16/XMODEM": (2, 0x1021, 0x0000, False, 0x0000, 0x31C3),
    "CRC-16/KERMIT": (2, 0x1021, 0x0000, True, 0x0000, 0x2189),
    "CRC-16/MODBUS": (2, 0x8005, 0xFFFF, True, 0x0000, 0x4B37),
    "CRC-16/GENIBUS": (2, 0x1021, 0xFFFF, False, 0xFFFF, 0xD64E),
    # the initial values of these differ from their mirror images
    "CRC-16/RIELLO": (2, 0x1021, 0xB2AA, True, 0x0000, 0x63D0),
    "CRC-16/TMS37157": (2, 0x1021, 0x89EC, True, 0x0000, 0x26B1),
    "CRC-24/OPENPGP": (3, 0x864CFB, 0xB704CE, False, 0x000000, 0x21CF02),
    "CRC-32/ISO-HDLC": (4, 0x04C11DB7, 0xFFFFFFFF, True, 0xFFFFFFFF, 0xCBF43926),
    "CRC-32/BZIP2": (4, 0x04C11DB7, 0xFFFFFFFF, False, 0xFFFFFFFF, 0xFC891918),
    "CRC-64/XZ": (8, 0x42F0E1EBA9EA3693, (1 << 64) - 1, True, (1 << 64) - 1, 0x995DC9BBDF1939FA),
}

CHECKS = [
    *(Crc(*parameters[:-1]) for parameters in CATALOGUE.values()),
    *(Sum(size, complement) for size in (1, 2, 4) for complement in ("none", "ones", "twos")),
    Xor(),
]


@pytest.mark.parametrize("parameters", CATALOGUE.values(), ids=CATALOGUE)
def test_the_check_values_of_the_catalogue(
    parameters: tuple[int, int, int, bool, int, int],
) -> None:
    *made, value = parameters
    assert Crc(*made).of(DIGITS) == value


@given(st.binary(max_size=80))
def test_crcs_of_the_standard_library(data: bytes) -> None:
    assert Crc(4, 0x04C11DB7, 0xFFFFFFFF, True, 0xFFFFFFFF).of(data) == binascii.crc32(data)
    assert Crc(2, 0x1021, 0, False, 0).of(data) == binascii.crc_hqx(data, 0)
    assert Crc(2, 0x1021, 0xFFFF, False, 0).of(data) == binascii.crc_hqx(data, 0xFFFF)


@given(st.binary(max_size=40), st.sampled_from(CHECKS))
def test_every_check_agrees_with_its_definition(data: bytes, check: Check) -> None:
    found = check.of(data)
    assert found == reference_check(check, data)
    assert 0 <= found < 1 << 8 * check.size


@pytest.mark.parametrize(
    ("check", "value"),
    [
        (Sum(1), 0xDD), (Sum(1, "ones"), 0x22), (Sum(1, "twos"), 0x23), (Sum(2), 0x01DD),
        (Sum(2, "twos"), 0xFE23), (Xor(), 0x31),
    ],
)  # fmt: skip
def test_sums(check: Check, value: int) -> None:
    assert check.of(DIGITS) == value
    assert check.of(b"") == (0xFF if check == Sum(1, "ones") else 0)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Sum(0), "a check has 1 to 8 bytes, not 0"),
        (lambda: Sum(9), "a check has 1 to 8 bytes, not 9"),
        (lambda: Sum(1, "two"), "one of none, ones, twos, not two"),
        (lambda: Crc(1, 0x1021, 0, False, 0), "polynomial 0x1021 does not fit 8 bits"),
        (lambda: Crc(1, 0x07, -1, False, 0), "initial -0x1 does not fit"),
        (lambda: Crc(2, 0x07, 0, False, 0x10000), "final 0x10000 does not fit 16 bits"),
        (lambda: Crc(0, 0, 0, False, 0), "1 to 8 bytes"),
    ],
)
def test_invalid_checks(make: object, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        make()  # type: ignore[operator]


def test_checks_are_values() -> None:
    for check in CHECKS:
        assert pickle.loads(pickle.dumps(check)) == check == copy.copy(check)
        assert hash(copy.deepcopy(check)) == hash(check)
        assert eval(repr(check), {"Crc": Crc, "Sum": Sum, "Xor": Xor}) == check
    assert len(set(CHECKS)) == len(CHECKS)
    with pytest.raises(AttributeError, match="Sum is immutable"):
        Sum(1).size = 2
