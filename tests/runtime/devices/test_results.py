"""The results of calls and subscriptions: time of arrival, plain data, text, HTML, frames and quantities."""

from __future__ import annotations

import json
import pickle
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from proof_controller import HOST, Controller
from proof_line import SIDES, Side, settled

from stagewire_apt import messages as m
from stagewire_apt.devices import TDC001
from stagewire_apt.devices import values as v

USB = 0x50
URL = "virtual://TDC001?stage=Z8"
each_side = pytest.mark.parametrize("side", SIDES, ids=repr)


def status(position: int = 0, bits: int = 0) -> m.MotGetDcStatusUpdate:
    return m.MotGetDcStatusUpdate(chan_ident=1, position=position, velocity=0, status_bits=bits)


@each_side
def test_values_of_a_subscription_carry_the_time_when_they_arrived(side: Side) -> None:
    far = Controller()

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False, stage="Z8") as device:
            values, events = device.subscribe(v.DcStatusUpdate), device.subscribe()
            far.say(status().pack(HOST, USB))
            event = await settled(events.get(1))
            read = device.session.now()
            await bench.sleep(0.2)
            later = datetime.now(UTC)
            value = await settled(values.get(1))
            assert value.received == event.received <= read
            late = timedelta(seconds=device.session.now() - value.received)
            assert late >= timedelta(seconds=0.2)
            assert value.received_at <= later + timedelta(milliseconds=50) - late + (
                datetime.now(UTC) - later
            )

    side.run(far, scenario)


def test_a_reply_carries_the_time_when_it_arrived() -> None:
    with TDC001.open(URL, stage="Z8") as tdc:
        began, before = tdc.session.now(), datetime.now(UTC)
        first = tdc.get_dc_status_update()
        second = tdc.get_vel_params()
        after, ended = datetime.now(UTC), tdc.session.now()
        assert began <= first.received <= second.received <= ended
        assert before <= first.received_at <= second.received_at <= after
        assert first.received_at.tzinfo is UTC


def test_the_values_of_the_end_of_a_motion_carry_the_time_of_the_end() -> None:
    with TDC001.open(URL, stage="Z8") as tdc:
        began = tdc.session.now()
        end = tdc.move_relative(mm=0.01)
        assert end.values is not None
        assert began + end.seconds <= end.values.received <= tdc.session.now()


def test_a_status_keeps_its_time_when_it_is_pickled_and_is_compared_without_it() -> None:
    with TDC001.open(URL, stage="Z8") as tdc:
        first, second = tdc.get_dc_status_update(), tdc.get_dc_status_update()
    copy = pickle.loads(pickle.dumps(first))
    assert (copy.received, copy.received_at) == (first.received, first.received_at)
    assert first == second
    assert first.received < second.received


def test_asdict_is_plain_data_in_engineering_units() -> None:
    with TDC001.open(URL, stage="Z8") as tdc:
        one = tdc.values(status(34304, 0x80000400 | 0x40000))
        assert isinstance(one, v.DcStatusUpdate)
        plain = one.asdict()
        assert json.loads(json.dumps(plain)) == plain
        assert plain["received"] == one.received
        assert datetime.fromisoformat(plain["received_at"]) == one.received_at
        del plain["received"], plain["received_at"]
        assert plain == {
            "chan_ident": "CHAN1",
            "position_mm": 1.0,
            "velocity": 0,
            "status_bits": list(one.status_bits.names),
        }
        assert "homed" in plain["status_bits"]


def test_asdict_has_counts_where_the_scale_is_unknown() -> None:
    with TDC001.open(URL) as tdc:
        plain = tdc.values(status(34304)).asdict()  # type: ignore[union-attr]
    assert plain["position"] == 34304
    assert "position_mm" not in plain


def test_asdict_of_a_set_of_parameters_has_its_settings_in_units() -> None:
    with TDC001.open(URL, stage="Z8") as tdc:
        plain = tdc.change_vel_params(max_velocity_mm_per_s=2).asdict()
    assert plain["max_velocity_mm_per_s"] == pytest.approx(2, abs=1e-4)
    assert "max_velocity" not in plain


def test_asdict_of_the_identity_is_plain_data() -> None:
    with TDC001.open(URL, stage="Z8") as tdc:
        assert tdc.info is not None
        plain = tdc.info.asdict()
        assert plain["serial_number"] == tdc.serial_number
    assert json.loads(json.dumps(plain)) == plain
