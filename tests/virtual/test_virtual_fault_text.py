"""Faults as text: their syntax, and the errors for invalid ones."""

from __future__ import annotations

import contextlib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stagewire.protocols import Direction
from stagewire_virtual.errors import FaultError
from stagewire_virtual.faults.fault import ACTIONS, KEYS, Action, Fault, Piece, parse_fault

TO_HOST, TO_CONTROLLER = Direction.TO_HOST, Direction.TO_CONTROLLER
FRAME, BYTE = Piece.FRAME, Piece.BYTE


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (
            "to_host drop frame every=10",
            Fault(action=Action.DROP, direction=TO_HOST, piece=FRAME, every=10),
        ),
        ("to_host drop", Fault(action=Action.DROP, direction=TO_HOST, piece=FRAME)),
        (
            " to_controller  insert byte p=0.01 seed=3 ",
            Fault(action=Action.INSERT, direction=TO_CONTROLLER, piece=BYTE, p=0.01, seed=3),
        ),
        (
            "to_host insert hex=640401000150 message=MOT_GET_VELPARAMS",
            Fault(
                action=Action.INSERT,
                direction=TO_HOST,
                data=bytes.fromhex("640401000150"),
                message="MOT_GET_VELPARAMS",
            ),
        ),
        (
            "to_controller flip byte at=3 bit=7",
            Fault(action=Action.FLIP, direction=TO_CONTROLLER, piece=BYTE, at=3, bit=7),
        ),
        (
            "to_host delay by=2 overtaken=yes",
            Fault(action=Action.DELAY, direction=TO_HOST, by=2, overtaken=True),
        ),
        (
            "to_host duplicate frame count=3",
            Fault(action=Action.DUPLICATE, direction=TO_HOST, count=3),
        ),
        (
            "to_host flood after=1.5 count=1000 period=0",
            Fault(action=Action.FLOOD, direction=TO_HOST, after=1.5, count=1000, period=0),
        ),
        ("to_host disconnect at=9", Fault(action=Action.DISCONNECT, direction=TO_HOST, at=9)),
        (
            "stick bay=1 channel=1 after=2 for=0.5",
            Fault(action=Action.STICK, bay=1, channel=1, after=2, lasting=0.5),
        ),
        ("stick axis=X", Fault(action=Action.STICK, axis="X")),
    ],
)
def test_a_text_is_parsed_to_a_fault(text: str, fault: Fault) -> None:
    assert parse_fault(text) == fault
    assert parse_fault(str(fault)) == fault


def test_the_default_piece_depends_on_the_action() -> None:
    assert parse_fault("to_host drop at=1").piece is FRAME
    assert parse_fault("to_host disconnect at=1").piece is BYTE
    for text in ("stick channel=1", "to_host flood count=3", "to_host disconnect after=1.5"):
        assert parse_fault(text).piece is None
        assert not {"byte", "frame"} & set(str(parse_fault(text)).split())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "unknown direction '' (choose from to_host, to_controller, stick)"),
        ("tohost drop", "unknown direction 'tohost'; did you mean to_host? (choose"),
        ("drop frame", "unknown direction 'drop'"),
        ("to_host", "unknown action ''"),
        ("to_host drp", "unknown action 'drp'; did you mean drop? (choose from drop, insert,"),
        ("to_host drop evry=3", "unknown key 'evry'; did you mean every? (choose from every,"),
        ("to_host drop by=3", "drop has no key 'by' (choose from every, at, p, seed, message)"),
        ("to_host drop every", "'every' is not KEY=VALUE; byte or frame comes before all keys"),
        ("to_host drop at=1 byte", "'byte' is not KEY=VALUE"),
        ("to_host drop at=1 at=2", "at is given more than once"),
        ("to_host drop every=0", "every must be a whole number from 1 to 1,000,000,000, not 0"),
        ("to_host drop every=x", "every must be a whole number from 1 to 1,000,000,000, not 'x'"),
        (f"to_host drop every={'9' * 5000}", "every must be a whole number"),
        ("to_host drop every=", "every must be a whole number from 1 to 1,000,000,000, not ''"),
        ("to_host drop p=1.5", "p must be a probability from 0 to 1, not 1.5"),
        ("to_host drop p=nan", "p must be a probability from 0 to 1, not nan"),
        ("to_host delay by=inf", "by must be seconds from 0 to 1,000,000, not inf"),
        ("to_host delay by=-1", "by must be seconds from 0 to 1,000,000, not -1.0"),
        ("to_host delay by=1 overtaken=maybe", "overtaken must be yes or no, not 'maybe'"),
        ("to_host delay", "delay requires by=SECONDS"),
        ("to_host drop every=2 at=3", "every and at exclude each other; give only one of them"),
        ("to_host flood at=1 after=1", "at and after exclude each other"),
        ("to_host flood after=1 message=X", "message requires every, at or p, and excludes after"),
        ("to_host insert frame", "insert frame requires hex=BYTES; insert byte inserts a random"),
        ("to_host drop seed=3", "seed requires a random choice: p, flip without bit, or insert"),
        ("to_host flip bit=1 seed=3", "seed requires a random choice"),
        ("to_host disconnect after=1 seed=3", "seed requires a random choice"),
        ("to_host disconnect frame after=1", "frame requires a rule: every, at, p or message"),
        ("to_host flood byte", "byte requires a rule: every, at, p or message"),
        ("to_host flip byte bit=8", "bit must be from 0 to 7 for a byte, not 8"),
        ("to_host flood count=1000001", "count must be a whole number from 1 to 1,000,000"),
        ("to_host insert hex=5", "hex must be bytes in hex without blanks, such as 640401000150"),
        ("to_host insert hex=", "hex must be bytes in hex"),
        ("to_host drop message=", "message must be the name of a message, not ''"),
        ("to_host stick channel=1", "stick has no direction"),
        ("stick", "stick requires channel=N, with bay=N in a rack, or axis=NAME"),
        ("stick axis=X channel=1", "stick requires channel=N"),
        ("stick axis=X bay=1", "bay requires channel and excludes axis"),
        ("stick frame channel=1", "stick accepts neither byte nor frame"),
        ("stick channel=1 every=2", "stick has no key 'every'"),
    ],
)
def test_an_invalid_fault_is_explained(text: str, said: str) -> None:
    with pytest.raises(FaultError) as caught:
        parse_fault(text)
    assert said in str(caught.value)
    assert str(caught.value).startswith(f"fault {text[:40]!r}"[:40])
    assert len(str(caught.value)) < 600


def test_fault_values_are_checked_like_text() -> None:
    with pytest.raises(FaultError, match="drop requires a direction, to_host or to_controller"):
        Fault(action=Action.DROP)
    with pytest.raises(FaultError, match="drop requires a direction"):
        Fault(action=Action.DROP, direction=Direction.BOTH)
    with pytest.raises(FaultError, match="every must be a whole number"):
        Fault(action=Action.DROP, direction=TO_HOST, every=True)
    with pytest.raises(FaultError, match="message must be the name of a message"):
        Fault(action=Action.DROP, direction=TO_HOST, message="MOT GET")
    with pytest.raises(FaultError, match="'frame' is neither byte nor frame"):
        Fault(action=Action.DROP, direction=TO_HOST, piece="frame")  # type: ignore[arg-type]


VALUES: dict[str, st.SearchStrategy[Any]] = {
    **dict.fromkeys(("every", "at", "channel"), st.integers(1, 10**9)),
    "count": st.integers(1, 10**6),
    **dict.fromkeys(("seed", "bit", "bay"), st.integers(0, 10**9)),
    **dict.fromkeys(("by", "period", "after", "for"), st.floats(0, 10**6)),
    "p": st.floats(0, 1),
    "overtaken": st.booleans(),
    "hex": st.binary(min_size=1, max_size=8),
    "message": st.sampled_from(["MOT_GET_VELPARAMS", "READ_STATUS"]),
    "axis": st.sampled_from(["X", "Y"]),
}


@given(st.data())
def test_every_printed_fault_parses_to_an_equal_fault(data: st.DataObject) -> None:
    action = data.draw(st.sampled_from(Action))
    kind = ACTIONS[action]
    given_keys = data.draw(st.sets(st.sampled_from(kind.keys)))
    values = {KEYS[name].attribute: data.draw(VALUES[name]) for name in sorted(given_keys)}
    if kind.has_direction:
        values["direction"] = data.draw(st.sampled_from([TO_HOST, TO_CONTROLLER]))
        values["piece"] = data.draw(st.sampled_from([None, *Piece]))
    try:
        fault = Fault(action=action, **values)
    except FaultError:
        return  # keys that exclude each other have their own tests
    assert parse_fault(str(fault)) == fault
    assert hash(parse_fault(str(fault))) == hash(fault)


@given(st.text(alphabet="to_hsedrpfamy =0123.", max_size=60))
def test_any_text_is_a_fault_or_refused(text: str) -> None:
    with contextlib.suppress(FaultError):
        parse_fault(text)
