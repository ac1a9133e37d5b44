"""Subscriptions: bounded queues of unsolicited events; and counts of received events."""

from __future__ import annotations

import logging

import pytest
from stepped_core import Commands, Framed, dc_status, said, vel_params

from stagewire.errors import BadValueError, OutOfRangeError, SessionClosedError, TransportLostError
from stagewire.framing import BadLength, Garbage, Received, Undocumented, Unknown
from stagewire_apt import messages as m
from undocumented import HwUnprinted

UNKNOWN = bytes.fromhex("fe7f00000150")
TOO_SHORT = bytes.fromhex("150404008150") + bytes(4)


def everything(subscription):
    events = []
    while (event := subscription.take()) is not None:
        events.append(event)
    return events


def test_unsolicited_events_are_dispatched():
    talk = Framed()
    news = talk.core.subscribe()
    talk.hear(said(dc_status(1)), said(vel_params()), said(HwUnprinted(bytes(68))))
    talk.hear(UNKNOWN, TOO_SHORT, b"\0")
    talk.later(1)
    kinds = [type(event) for event in everything(news)]
    assert kinds == [Received, Received, Undocumented, Unknown, BadLength, Garbage]
    assert news.take() is None


def test_a_requested_status_is_dispatched_but_other_replies_are_not():
    talk = Framed()
    news = talk.core.subscribe()
    talk.ask()
    talk.hear(said(vel_params()))
    assert everything(news) == []
    asked = talk.ask(m.MotReqDcStatusUpdate(1), (m.MotGetDcStatusUpdate,))
    talk.hear(said(dc_status(3)))
    assert asked.value().message == dc_status(3)
    [event] = everything(news)
    assert event.frame.message == dc_status(3)


def test_the_end_of_a_motion_is_dispatched_but_a_late_reply_is_not():
    talk = Framed()
    news = talk.core.subscribe()
    talk.ask()
    talk.later(1)
    talk.move()
    talk.hear(said(vel_params()), said(m.MotMoveCompletedHeader(1)))
    [event] = everything(news)
    assert event.frame.message == m.MotMoveCompletedHeader(1)


def test_a_subscription_to_messages_includes_all_forms():
    talk = Framed()
    news = talk.core.subscribe(m.MotMoveCompletedHeader)
    both = talk.core.subscribe((m.MotMoveHomed, m.MotGetDcStatusUpdate))
    completed = m.MotMoveCompletedDc(chan_ident=1, position=4, velocity=0, status_bits=0)
    talk.hear(said(completed), said(dc_status()), said(m.MotMoveHomed(1)), UNKNOWN)
    assert len(everything(news)) == 1
    assert len(everything(both)) == 2


def test_subscriptions_to_kinds_of_events_and_by_a_condition():
    talk = Framed()
    odd = talk.core.subscribe((Unknown, Garbage))
    big = talk.core.subscribe(lambda event: len(event.raw) > 10)
    talk.hear(said(dc_status()), UNKNOWN, b"\0")
    talk.later(1)
    assert [type(event) for event in everything(odd)] == [Unknown, Garbage]
    assert [type(event) for event in everything(big)] == [Received]


def test_a_subscription_to_an_address_includes_events_without_one():
    talk = Framed()
    news = talk.core.subscribe(m.MotGetDcStatusUpdate, source=0x22)
    talk.hear(said(dc_status(1), 0x21), said(dc_status(2), 0x22), said(dc_status(3), 0, 0))
    assert [event.frame.message.position for event in everything(news)] == [2, 3]


def test_a_failing_condition_ends_only_its_own_subscription():
    talk = Framed()
    asked = []
    wrong = talk.core.subscribe(lambda event: asked.append(event) or event.nothing)
    right = talk.core.subscribe(m.MotGetDcStatusUpdate)
    talk.hear(said(dc_status()), said(dc_status()))
    assert len(everything(right)) == 2
    assert "condition of the subscription failed" in str(wrong.error)
    assert isinstance(wrong.error.__cause__, AttributeError)
    assert len(wrong) == 0
    talk.hear(said(dc_status()))
    assert len(asked) == 1


def test_a_full_queue_drops_the_oldest_and_warns_once(caplog):
    talk = Framed()
    news = talk.core.subscribe(m.MotGetDcStatusUpdate, limit=3)
    with caplog.at_level(logging.WARNING, "stagewire"):
        for position in range(8):
            talk.hear(said(dc_status(position)))
    assert [event.frame.message.position for event in everything(news)] == [5, 6, 7]
    assert news.dropped == 5
    assert talk.core.statistics.dropped == 5
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert "dropped its oldest event" in caplog.text


def test_a_callback_is_called_for_each_queued_event():
    talk = Framed()
    news = talk.core.subscribe(m.MotGetDcStatusUpdate)
    told = []
    news.on_event = lambda: told.append(len(news))
    talk.hear(said(dc_status()), said(vel_params()), said(dc_status()))
    assert told == [1, 2]


def test_a_closed_subscription_receives_nothing():
    talk = Framed()
    news = talk.core.subscribe()
    talk.hear(said(dc_status()))
    for _ in range(2):
        news.close()
    talk.hear(said(dc_status()))
    assert len(everything(news)) == 1


@pytest.mark.parametrize(
    ("end", "error"),
    [
        (lambda core: core.lose("unplugged", 1), TransportLostError),
        (lambda core: core.close(1), SessionClosedError),
    ],
)
@pytest.mark.parametrize("kind", [Framed, Commands])
def test_the_end_of_a_session_ends_its_subscriptions(kind, end, error):
    talk = kind()
    before = talk.any.subscribe()
    told = []
    before.on_event = lambda: told.append(before.error)
    end(talk.any)
    assert [type(why) for why in told] == [error]
    assert type(talk.any.subscribe().error) is error


@pytest.mark.parametrize("wrong", [(), 5, "status", (m.MotMoveHomed, Garbage), (5,), int])
def test_invalid_subscriptions_are_refused(wrong):
    with pytest.raises(BadValueError, match="subscribe takes classes of messages"):
        Framed().core.subscribe(wrong)


@pytest.mark.parametrize("limit", [0, -1, True, 1.5, None])
def test_a_limit_must_be_a_positive_integer(limit):
    with pytest.raises(OutOfRangeError, match="at least 1"):
        Framed().core.subscribe(limit=limit)


def test_events_of_a_command_line_have_no_source():
    with pytest.raises(BadValueError, match="events on this line have no address"):
        Commands().core.subscribe(source=1)


def test_bad_input_is_counted_and_raises_no_error():
    talk = Framed()
    talk.hear(said(dc_status()), said(dc_status()), UNKNOWN, TOO_SHORT)
    talk.hear(said(HwUnprinted(bytes(68))), b"\0\0\0")
    talk.later(1)
    counted = talk.core.statistics.values()
    assert {name: count for name, count in counted.items() if count} == {
        "unknown": 1, "bad_length": 1, "undocumented": 1, "garbage": 3, "silences": 1,
    }  # fmt: skip
    assert talk.core.counts == {0x491: 2, 0xF1: 1}
    assert repr(talk.core.statistics) == (
        "Statistics(bad_length=1, garbage=3, silences=1, undocumented=1, unknown=1)"
    )
