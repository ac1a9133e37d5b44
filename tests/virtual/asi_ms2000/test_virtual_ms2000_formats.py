"""Both formats of the MS-2000, the switches between them, every reading, and arbitrary bytes."""

import tracemalloc
from collections.abc import Mapping
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ms2000_host import Host

from stagewire_apt import stages
from stagewire_virtual.asi_ms2000.instrument import STRATEGIES, Ms2000Instrument
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.errors import BadOptionError, UnknownPartError
from stagewire_virtual.instrument import find_unit
from stagewire_virtual.options import Options, Settings

LINES = [
    (b"W X\r", b":A 0\r\n"),
    (b"w z x\r", b":A 0 12345\r\n"),  # answered in the order of the axes
    (b"WHERE X Y Z\r\n", b":A 0 0 12345\r\n"),
    (b"  where   y  \r", b":A 0\r\n"),
    (b"W\r", b":N-3\r\n"),
    (b"W Q\r", b":N-2\r\n"),
    (b"W X F\r", b":N-2\r\n"),
    (b"/\r", b"N\r\n"),
    (b"status\r", b"N\r\n"),
    (b"MOVE X=10\r", b":N-1\r\n"),
    (b"\x80\xfe\r", b":N-1\r\n"),
    (b"\r\n \r", b""),
    (b"W X" + b" " * 252 + b"\r", b":A 0\r\n"),
    (b"W X" + b" " * 253 + b"\r", b":N-1\r\n"),
    (b"W X" + b" " * 5000 + b"\rW X\r", b":N-1\r\n:A 0\r\n"),
]


@pytest.mark.parametrize(("line", "answer"), LINES)
def test_lines_of_text_are_answered(line: bytes, answer: bytes) -> None:
    host = Host()
    host.write(65, 3, 12_345, axis=26)
    host.send(b"\xffA")
    assert host.send(line) == answer


def test_a_moving_axis_answers_where_and_status() -> None:
    host = Host()
    host.write(84, 3, 60_000, axis=25)
    host.send(b"\xffA")
    host.to(10.1)  # 30.603 tenths of a micrometre: 600,000 / 2 times the square of the time
    assert host.send(b"W Y\r/\r") == b":A 31\r\nB\r\n"
    assert host.send(b"\xffHW Y\r") == b":A 30.6\r\n"
    assert host.send(b"\xffTW Y\r") == b":A 31\r\n"
    host.to(3000)
    assert host.send(b"\xffHW X Y\r/\r") == b":A 0 60000\r\nN\r\n"


def test_a_setup_command_within_a_line_discards_the_line() -> None:
    host = Host(low_level=False)
    assert host.send(b"W \xffB\x18\x3f:\xffA X\r") == b"b:N-1\r\n"


def test_a_prefix_without_a_setup_letter_is_a_character() -> None:
    host = Host(low_level=False)
    assert host.send(b"\xffZ\r\xff\xff\xffB\x18?:") == b":N-1\r\nb"


def test_switching_to_the_present_format_has_no_effect() -> None:
    host = Host()
    assert host.ask("255 66 24 63 58") == "98"
    host = Host(low_level=False)
    assert host.send(b"\xffAW X\r") == b":A 0\r\n"


@pytest.mark.parametrize(("mode", "answer"), [("high", b":N-1\r\n"), ("low", b"b")])
def test_the_strategy_decides_the_format_after_power_on_and_reset(mode: str, answer: bytes) -> None:
    host = Host(strategies={"power_on_mode": mode}, low_level=False)
    assert host.send(b"\x18?:\r") == answer
    host.send(b"\xff" + (b"B" if mode == "high" else b"A"))
    assert host.send(b"\x18?:\r") != answer
    host.send(b"\r:\xffR")  # the first two bytes end a line or garbage
    assert host.send(b"\x18?:\r") == answer


def test_a_reset_restores_the_unit_of_where() -> None:
    host = Host()
    host.send(b"\xffH\xffR\xffB")
    host.write(84, 3, 60_000)
    host.to(10.1)
    assert host.send(b"\xffAW X\r") == b":A 31\r\n"


def test_a_reset_keeps_only_the_places_of_the_stages() -> None:
    host = Host(travel=10_000, position=1_000)
    host.write(84, 3, 20_000)
    host.to(100)
    host.instrument.power_cycle()
    assert host.send(b"\xffB") == b""
    assert (host.position, host.busy, host.speed) == (0, False, 0)
    host.write(84, 3, 20_000)
    host.to(5000)
    assert host.position < 9_000  # the upper end, relative to the position at the reset


# For each reading of an ambiguity in the document, the bytes sent and the answer.
READINGS = {
    # A target of 58 counts: three data bytes, the first of which is a colon.
    "colon_in_data=data": ("24 84 3 58 0 0 58 24 116 3 58", "58 0 0"),
    "colon_in_data=end": ("24 84 3 58 0 0 58 24 116 3 58", "0 0 0"),
    # A target of 16895 counts, whose bytes are 255, 65 and 0.
    "prefix_in_frame=data": ("24 84 3 255 65 0 58 24 116 3 58", "255 65 0"),
    "prefix_in_frame=setup": ("24 84 3 255 65 0 58 87 32 88 13 255 66 87 58", "58 78 45 49 13 10"),
    "missing_size=accepted": ("24 105 58 24 63 58 24 75 58 24 126 1 58", "69 77 79 84 32 58 98 2"),
    "missing_size=ignored": ("24 105 58 24 63 58 24 75 58 24 126 1 58", "98 2"),
}


@pytest.mark.parametrize("reading", READINGS)
def test_each_reading_of_the_format_is_followed(reading: str) -> None:
    strategy, value = reading.split("=")
    sent, answered = READINGS[reading]
    host = Host(strategies={strategy: value})
    assert host.ask(sent) == answered
    assert STRATEGIES[strategy][value]


def test_a_colon_in_data_can_end_the_command() -> None:
    host = Host(strategies={"colon_in_data": "end"})
    # 24 84 3 160 58 is dropped and 24 63 58 is a command; a controller that counts bytes loses the latter.
    assert host.ask("24 84 3 160 58 24 63 58") == "98"
    assert Host().ask("24 84 3 160 58 24 63 58") == ""


def test_255_in_data_is_kept_unless_a_setup_letter_follows() -> None:
    host = Host(strategies={"prefix_in_frame": "setup"})
    assert host.ask("24 84 3 255 255 255 58 24 116 3 58") == "255 255 255"
    assert host.ask("25 84 3 1 255 72 25 63 58") == "98"  # the incomplete command is discarded


def test_every_strategy_has_a_default_and_another_reading() -> None:
    tested = {reading.split("=")[0] for reading in READINGS}
    tested |= {
        "power_on_mode",
        "disabled_axis",
        "start_motor",
        "vector_speed",
    }  # tested above, and in test_virtual_ms2000_motion.py
    assert tested == set(STRATEGIES)
    assert all(len(found) == 2 for found in STRATEGIES.values())


def make(unit: str = "MS2000", **options: object) -> Ms2000Instrument:
    return Ms2000Instrument(find_unit(unit), SteppedClock(), Options(**options))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"strategies": {"colons": "data"}}, "MS2000 has no strategy colons (available: colon_in"),
        (
            {"strategies": {"colon_in_data": "x"}},
            "no colon_in_data reading x (available: data, end",
        ),
        ({"quirks": frozenset({"late"})}, "MS2000 has no quirk late"),
        ({"model": "MS"}, "MS2000 does not report a model"),
        ({"serial_number": 1}, "MS2000 does not report a serial number"),
        ({"hardware_type": 0}, "MS2000 does not report a hardware type"),
        ({"stage_id": 7}, "MS2000 does not report a stage id"),
        ({"answer_unsupported": True}, "MS2000 never answers unknown commands"),
        ({"empty_bays": frozenset({0})}, "MS2000 has no bays"),
        ({"channels": (Settings(),) * 5}, "MS2000 has only the axes X, Y, Z, F"),
        ({"channels": (Settings(stage=stages.Z8),)}, "counts in tenths of a micrometre"),
        ({"channels": (Settings(travel=0),)}, "MS2000 requires a travel above 0, not 0"),
        ({"channels": (Settings(travel=5, position=6),)}, "start at 6 within a travel of 5"),
        ({"channels": (Settings(position=-1),)}, "start at -1 within a travel of 1000000"),
    ],
)
def test_unsupported_options_are_refused(options: Mapping[str, object], sentence: str) -> None:
    with pytest.raises(BadOptionError, match=sentence.replace("(", r"\(")):
        make(**options)


def test_the_last_settings_apply_to_further_axes() -> None:
    axes = make(channels=(Settings(travel=9, position=0), Settings(travel=5, position=5))).axes
    assert [name for name, axis in axes.items() if axis.status & 128] == ["X"]
    assert [name for name, axis in axes.items() if axis.status & 64] == ["Y", "Z"]


def test_settings_for_a_fourth_channel_add_an_axis() -> None:
    assert list(make().axes) == ["X", "Y", "Z"]
    instrument = make(channels=(Settings(),) * 4, strategies={"power_on_mode": "low"})
    assert list(instrument.axes) == ["X", "Y", "Z", "F"]
    said: list[bytes] = []
    instrument.on_send = said.append
    instrument.receive(bytes((27, 63, 58)))
    assert said == [b"b"]


def test_rows_describe_the_state_of_the_axes() -> None:
    host = Host()

    def first() -> tuple[str, str, str]:
        row = host.instrument.rows()[0]
        return row.part, row.position, row.state

    assert [row.part for row in host.instrument.rows()] == ["axis X", "axis Y", "axis Z"]
    assert first() == ("axis X", "0.0000 mm", "idle")
    host.write(84, 3, -12_345)
    host.to(150)
    assert first()[2] == "moving down"
    host.to(306)
    assert first() == ("axis X", "-1.2345 mm", "settling")
    host.write(84, 3, 0)
    host.to(400)
    assert first()[2] == "moving up"
    host.ask("24 66 58")
    assert first()[2] == "stopped"


def test_an_unknown_axis_cannot_stick() -> None:
    with pytest.raises(UnknownPartError, match=r"no axis F \(available: axis X, axis Y, axis Z"):
        make().stick("axis F", True)


_BYTES = st.one_of(
    st.binary(max_size=40),
    st.lists(
        st.sampled_from(
            [
                b"\x18",
                b"\x19",
                b"?",
                b"a",
                b"T",
                b"A",
                b"\x03",
                b":",
                b"\xff",
                b"B",
                b"R",
                b"H",
                b"\x18?:",
                b"\x18a\x03:",
                b"\x18T\x03\x10\x27\x00:",
                b"\xffB",
                b"\xffA",
                b"W X\r",
            ]
        ),
        max_size=30,
    ).map(b"".join),
)
_STRATEGIES = st.fixed_dictionaries(
    {name: st.sampled_from(list(found)) for name, found in STRATEGIES.items()}
)


@settings(max_examples=150, deadline=None)
@given(data=_BYTES, cuts=st.lists(st.integers(0, 60), max_size=5), chosen=_STRATEGIES)
def test_answers_do_not_depend_on_chunks(
    data: bytes, cuts: list[int], chosen: dict[str, str]
) -> None:
    whole, cut = Host(strategies=chosen), Host(strategies=chosen)
    answered = whole.send(data)
    edges = [0, *sorted(min(place, len(data)) for place in cuts), len(data)]
    parts = [data[begin:end] for begin, end in pairwise(edges)]
    assert b"".join(cut.send(part) for part in parts) == answered
    assert (cut.refusals, cut.instrument.rows()) == (whole.refusals, whole.instrument.rows())


@pytest.mark.parametrize("low_level", [True, False])
@pytest.mark.parametrize("byte", [b"a", b"\x00", b"\xff"])
def test_endless_input_uses_bounded_memory(low_level: bool, byte: bytes) -> None:
    host = Host(low_level=low_level)
    host.send(byte * 1000)
    tracemalloc.start()
    try:
        for _ in range(20):
            host.send(byte * 1000)
        assert tracemalloc.get_traced_memory()[0] < 5_000
    finally:
        tracemalloc.stop()


@settings(max_examples=150, deadline=None)
@given(data=st.binary(max_size=600) | _BYTES, chosen=_STRATEGIES, low_level=st.booleans())
def test_a_controller_still_answers_after_any_bytes(
    data: bytes, chosen: dict[str, str], low_level: bool
) -> None:
    host = Host(strategies=chosen, low_level=low_level)
    host.send(data)
    host.clock.advance(1)
    # A carriage return ends a line, and as many colons as the longest command has bytes end any command.
    host.send(b"\r" + b":" * 260 + b"\xffB")
    assert host.send(b"\x19i\x06:") == b"EMOT :"
