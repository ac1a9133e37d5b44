"""The results of calls and subscriptions: time of arrival, plain data, text, HTML, frames and quantities."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from importlib import import_module
from pkgutil import walk_packages
from typing import Any
from xml.etree import ElementTree

import pytest
from proof_controller import HOST, Controller
from proof_line import SIDES, Side, settled

import stagewire
import stagewire_apt
import stagewire_ms2000
from stagewire.errors import BadValueError
from stagewire_apt import messages as m
from stagewire_apt.devices import BSC203, TDC001, TNA001
from stagewire_apt.devices import values as v
from stagewire_apt.flags import DcStatusBits

USB = 0x50
MOVING = [name for name in DcStatusBits.bits if name.startswith(("moving", "jogging", "homing"))]
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


def test_the_text_of_a_status_fits_one_line_and_begins_with_position_homed_and_motion() -> None:
    with TDC001.open(URL, stage="Z8") as tdc:
        motion = DcStatusBits.of(moving_forward=True)
        others = ~(motion | DcStatusBits.of(**dict.fromkeys(MOVING, True))) & 0xFFFFFFFF
        one = tdc.values(status(34304, motion | others))
        text = repr(one)
    assert text.startswith("<DcStatusUpdate position 1 mm, homed, moving forward, ")
    assert len(text) <= 100
    assert text.endswith(", …>")
    assert "\n" not in text


def test_the_text_of_a_stage_at_rest_says_so() -> None:
    with TDC001.open(URL) as tdc:
        assert repr(tdc.values(status(-5))) == (
            "<DcStatusUpdate position -5, not homed, at rest, velocity 0, chan_ident CHAN1>"
        )


def test_the_text_of_parameters_is_in_units() -> None:
    with TDC001.open(URL, stage="Z8") as tdc:
        changed = tdc.change_vel_params(max_velocity_mm_per_s=2)
    assert repr(changed).endswith("max_velocity 2 mm/s, chan_ident CHAN1>")


def test_the_text_of_the_end_of_a_motion_has_its_duration_and_values() -> None:
    with TDC001.open(URL, stage="Z8") as tdc:
        text = repr(tdc.move_relative(mm=0.01))
    assert text.startswith("<MotionEnd after 0.")
    assert " s: MoveCompletedDc position 0.0" in text


def test_the_html_of_a_device_shows_its_identity_and_the_values_read_last() -> None:
    with TDC001.open(URL, stage="Z8") as tdc:
        tdc.get_dc_status_update()
        tdc.change_vel_params(max_velocity_mm_per_s=2)
        html = tdc._repr_html_()
        for text in ("TDC001", str(tdc.serial_number), "stage Z8", "DcStatusUpdate", "2 mm/s"):
            assert text in html
        tdc.set_vel_params(min_velocity=0, acceleration=1, max_velocity=2)
        assert "VelParams" not in tdc._repr_html_()  # it was read before it was written
    ElementTree.fromstring(html)


@each_side
def test_text_and_html_of_a_device_send_nothing(side: Side) -> None:
    far = Controller()

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False) as device:
            sent = far.raw
            assert "no values were received" in device._repr_html_()
            assert repr(device)
            assert str(device)
            await bench.sleep(0.05)
            assert far.raw == sent

    side.run(far, scenario)


def test_the_html_of_a_channel_shows_only_its_own_values() -> None:
    with BSC203.open("virtual://BSC203", stages={1: "APT_STEPPER"}) as bsc:
        bsc.bay(1).change_jog_params(step_size_mm=1)
        bsc.bay(2).get_status_update()
        shown = [part._repr_html_() for part in (bsc.bay(1), bsc.bay(2), bsc)]
    assert ["step_size" in html and "1 mm" in html for html in shown] == [True, False, True]


def test_the_html_of_values_is_escaped() -> None:
    with TDC001.open(URL) as tdc:
        assert tdc.info is not None
        info = tdc.info.message.replace(notes="<b>&")
        html = tdc.values(info)._repr_html_()  # type: ignore[union-attr]
    assert "&lt;b&gt;&amp;" in html
    ElementTree.fromstring(html)


def test_statuses_become_a_data_frame_with_units_and_named_bits() -> None:
    pytest.importorskip("pandas")
    with TDC001.open(URL, stage="Z8") as tdc:
        several = [tdc.get_dc_status_update() for _ in range(3)]
        frame = stagewire.dataframe(several)
    assert list(frame["received"]) == [one.received for one in several]
    assert list(frame["received_at"]) == [one.received_at for one in several]
    assert frame["position_mm"].dtype == float
    assert not frame["status_bits.homed"].any()
    assert frame.attrs["units"] == {"received": "s", "position_mm": "mm"}
    assert len(stagewire.dataframe(several[0])) == 1


@each_side
def test_the_queued_items_of_a_subscription_become_a_data_frame(side: Side) -> None:
    pytest.importorskip("pandas")
    far = Controller()

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False, stage="Z8") as device:
            values, events = device.subscribe(v.DcStatusUpdate), device.subscribe()
            far.say(status(1).pack(HOST, USB) + status(34304).pack(HOST, USB))
            await settled(events.get(1))
            frame = stagewire.dataframe(values)
            assert frame["position_mm"].iloc[1] == 1.0
            assert not len(stagewire.dataframe(values))

    side.run(far, scenario)


def test_a_data_frame_of_messages_is_refused() -> None:
    pytest.importorskip("pandas")
    with pytest.raises(BadValueError, match=r"device.values\(\) converts a message"):
        stagewire.dataframe([status()])  # type: ignore[list-item]


def test_values_are_quantities_of_pint_that_calls_accept() -> None:
    pint = pytest.importorskip("pint")
    with TDC001.open(URL, stage="Z8") as tdc:
        one = tdc.values(status(34304))
        assert one is not None
        position = one.quantities()["position"]
        assert position == pint.get_application_registry().Quantity(1, "mm")
        assert position.to("um").magnitude == pytest.approx(1000)
        assert "velocity" not in one.quantities()  # its scale is unknown
        end = tdc.move_absolute(mm=position / 10)
        assert end.values.position_mm == pytest.approx(0.1, abs=0.01)


def test_pint_knows_every_unit_of_the_registries() -> None:
    """NT, a unit of NanoTraks, is not in pint: `quantities` defines it."""
    pint = pytest.importorskip("pint")
    units = {
        value.unit
        for package in (stagewire_apt, stagewire_ms2000)
        for module in walk_packages(package.__path__, f"{package.__name__}.")
        if ".devices.values" in module.name
        for cls in vars(import_module(module.name)).values()
        if isinstance(cls, type)
        for value in vars(cls).values()
        if getattr(value, "unit", "")
    }
    assert {"mm", "deg/s^2", "degC", "kohm", "um/s"} < units
    unknown = set()
    for unit in units:
        try:
            pint.UnitRegistry().Quantity(1, unit)
        except pint.UndefinedUnitError:
            unknown.add(unit)
    assert unknown == {"NT"}
    with TNA001.open("virtual://TNA001") as nanotrak:
        reading = nanotrak.reading().quantities()
        centre = reading["circ_pos_a"]
        assert (str(centre.units), centre.magnitude) == ("NT", pytest.approx(5, abs=0.01))
        nanotrak.change_nt_circ_home_pos(circ_home_pos_a_nt=centre / 2)
        assert nanotrak.get_nt_circ_home_pos().circ_home_pos_a_nt == pytest.approx(2.5, abs=0.01)
        with pytest.raises(BadValueError, match="must be in NT"):
            nanotrak.change_nt_circ_home_pos(circ_home_pos_a_nt=centre / centre)


BLOCKED = """
import sys
class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("pandas", "pyarrow", "pint", "numpy"):
            raise ImportError(f"{name} is blocked")
sys.meta_path.insert(0, Blocker())
import stagewire
from stagewire.errors import UnsupportedError
from stagewire_apt.devices import BSC203, TDC001
with TDC001.open("virtual://TDC001?stage=Z8", stage="Z8") as tdc:
    end = tdc.move_absolute(mm=0.02)
    status = tdc.get_dc_status_update()
    print(end, status, status.asdict(), status._repr_html_(), tdc, repr(tdc), tdc._repr_html_())
    for call, extra in ((status.quantities, "pint"), (lambda: stagewire.dataframe(status), "pandas")):
        try:
            call()
        except UnsupportedError as error:
            assert f"pip install 'stagewire[{extra}]'" in str(error), error
        else:
            raise AssertionError(extra)
"""


def test_the_base_never_imports_pandas_pyarrow_or_pint() -> None:
    found = subprocess.run([sys.executable, "-c", BLOCKED], capture_output=True, text=True)
    assert (found.returncode, found.stderr) == (0, "")
    program = BLOCKED.partition("    for call")[0].replace("raise ImportError", "print")
    program += "\nassert not {'pandas', 'pyarrow', 'pint', 'numpy'} & set(sys.modules)"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (found.returncode, found.stderr, "blocked" in found.stdout) == (0, "", False)
