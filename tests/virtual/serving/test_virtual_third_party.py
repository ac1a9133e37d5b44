"""Third-party clients with virtual controllers in real time.

thorlabs-apt-device uses a pty, like a USB adapter, and thorlabs-apt-protocol uses TCP. Each connects, homes,
moves, reads back, jogs, stops and closes. The tests compare its reports with the positions of the controller.
Distances are short and velocities high.

pyserial accepts that a pty has no RTS, so these clients can open one unchanged.
"""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from typing import Any

import pytest
import serial
import thorlabs_apt_protocol as apt
from thorlabs_apt_device.devices.aptdevice_motor import APTDevice_Motor
from thorlabs_apt_device.devices.bbd import BBD201, BBD202
from thorlabs_apt_device.devices.bsc import BSC
from thorlabs_apt_device.devices.tdc001 import TDC001

import stagewire_virtual as virtual
from stagewire_virtual.serving.server import ServedController

pytestmark = pytest.mark.matrix

needs_pty = pytest.mark.skipif(sys.platform == "win32", reason="requires pseudo-terminals")
HOST, USB, BAYS = 0x01, 0x50, (0x21, 0x22, 0x23)
# Without a stage, the values of a virtual motor are counts, counts/s and counts/s².
FAST = {"acceleration": 5_000_000, "max_velocity": 1_000_000}
TRAVEL, START = 400_000, 150_000


def until(is_so: Callable[[], object], what: str, seconds: float = 10.0) -> None:
    """Wait until another thread has made a condition true."""
    deadline, never = time.monotonic() + seconds, threading.Event()
    while not is_so():
        assert time.monotonic() < deadline, f"not within {seconds} s: {what}"
        never.wait(0.005)


def stands_at(served: ServedController) -> list[str]:
    """Return the position of each channel from the controller's own rows."""
    rows = served.call(lambda: served.instrument.rows())
    return [row.position for row in rows if row.position]


def is_silent(served: ServedController) -> bool:
    """Return whether the controller will send nothing more without a request."""
    return bool(served.call(lambda: served.link.clock.next_due is None))


@contextmanager
def client(make: Callable[..., APTDevice_Motor], served: ServedController) -> Iterator[Any]:
    """Yield a connected client, and close it.

    It reads as long as a byte arrives within 0.1 s, and sends nothing meanwhile. Because updates arrive every
    0.1 s, its commands and keep-alive messages would wait until the controller falls silent. A shorter
    timeout ends its reading between two updates.
    """
    made = make(served.url, home=False)
    made._port.timeout = 0.02
    try:
        yield made
    finally:
        made.close()
        made._thread.join(10)
    assert made._port is None


def bsc_of_three(url: str, **options: Any) -> BSC:
    return BSC(url, x=3, **options)


# Unit, quirks, client, bays, and the sign of a forward motion. The class for the TDC001 sends the opposite of
# the requested direction, so a controller whose position falls clockwise moves up.
DEVICES: list[tuple[str, tuple[str, ...], Callable[..., APTDevice_Motor], int, int]] = [
    ("TDC001", (), TDC001, 1, -1),
    ("TDC001", ("clockwise_is_negative",), TDC001, 1, 1),
    ("BSC103", (), bsc_of_three, 3, 1),
    ("BBD201", (), BBD201, 1, 1),
    ("BBD202", (), BBD202, 2, 1),
]


@needs_pty
@pytest.mark.parametrize(("unit", "quirks", "make", "bays", "forward"), DEVICES)
def test_thorlabs_apt_device(
    unit: str,
    quirks: tuple[str, ...],
    make: Callable[..., APTDevice_Motor],
    bays: int,
    forward: int,
    caplog: pytest.LogCaptureFixture,
) -> None:
    with (
        getattr(virtual, unit)(travel=TRAVEL, position=START, quirks=quirks) as controller,
        controller.pty() as served,
    ):
        with client(make, served) as device:
            for bay in range(bays):
                drive(device, served, bay, forward)
        until(lambda: is_silent(served), "the controller falls silent after the client has left")
    errors = [record for record in caplog.records if record.levelno >= logging.WARNING]
    assert not errors, "the client logged an error"


@needs_pty
def test_a_completion_without_status_ends_the_reading_of_thorlabs_apt_device(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Its parser assumes twenty bytes, and the exception ends its reader thread."""
    with (
        virtual.TDC001(quirks={"header_only_completion"}) as controller,
        controller.pty() as served,
        client(TDC001, served) as device,
    ):
        device.set_velocity_params(**FAST)
        device.move_relative(1_000)
        until(lambda: "struct.error" in caplog.text, "the client reads the short completion")


def drive(device: Any, served: ServedController, bay: int, forward: int) -> None:
    """Use every motor function of a client on one bay."""
    status = device.status_[bay][0]

    def is_at(position: int) -> bool:
        moving = status["moving_forward"] or status["moving_reverse"] or status["homing"]
        return status["position"] == position and not moving

    def arrives(position: int, what: str) -> None:
        until(lambda: is_at(position), f"{what}: at {position}")
        assert stands_at(served)[bay] == f"{position} counts"

    device.set_enabled(True, bay=bay)
    device.set_velocity_params(**FAST, bay=bay)
    device.set_jog_params(size=2_000, **FAST, bay=bay)
    device.set_home_params(velocity=1_000_000, offset_distance=0, bay=bay)
    until(lambda: device.homeparams_[bay][0]["home_velocity"] == 1_000_000, "parameters read back")
    assert device.velparams_[bay][0]["max_velocity"] == FAST["max_velocity"]
    assert device.jogparams_[bay][0]["step_size"] == 2_000
    assert not status["homed"]
    device.home(bay=bay)
    until(lambda: status["homed"], "homed")
    arrives(0, "homed")
    device.move_absolute(50_000, bay=bay)
    arrives(50_000, "absolute move")
    device.move_relative(-20_000, bay=bay)
    arrives(30_000, "relative move")
    device.move_jog("forward", bay=bay)
    arrives(30_000 + forward * 2_000, "jog")
    device.set_velocity_params(acceleration=5_000_000, max_velocity=10_000, bay=bay)
    device.move_velocity("forward", bay=bay)
    until(lambda: status["moving_forward"], "moving at a velocity")
    device.stop(bay=bay)
    until(lambda: not status["moving_forward"], "stopped")
    stopped = stands_at(served)[bay]
    assert stopped != f"{30_000 + forward * 2_000} counts"
    arrives(int(stopped.split()[0]), "after the stop")


class Host:
    """A typical program with thorlabs-apt-protocol, which makes frames with functions and unpacks them."""

    def __init__(self, url: str) -> None:
        self.port = serial.serial_for_url(url, timeout=0.05)
        self.unpacker = apt.Unpacker(self.port, on_error="raise")

    def ask(self, frame: bytes, answer: str) -> Any:
        """Send a frame and return the expected answer."""
        self.port.write(frame)
        found: list[Any] = []

        def has_come() -> bool:
            found.extend(message for message in self.unpacker if message.msg == answer)
            return bool(found)

        until(has_come, answer)
        return found[-1]

    def close(self) -> None:
        self.port.close()


@pytest.mark.parametrize(("unit", "dest"), [("TDC001", USB), ("BBD102", BAYS[1]), ("OST001", USB)])
def test_thorlabs_apt_protocol(unit: str, dest: int) -> None:
    to = {"dest": dest, "source": HOST}
    motor = {**to, "chan_ident": 1}
    bay = BAYS.index(dest) if dest in BAYS else 0
    with (
        getattr(virtual, unit)(travel=TRAVEL, position=START) as controller,
        controller.tcp() as served,
        closing(Host(served.url)) as host,
    ):
        # A bay answers with its own information, not with that of the motherboard.
        info = host.ask(apt.hw_req_info(**to), "hw_get_info")
        assert info.nchs == 1
        host.port.write(apt.mot_set_velparams(**motor, min_velocity=0, **FAST))
        parameters = host.ask(apt.mot_req_velparams(**motor), "mot_get_velparams")
        assert parameters.max_velocity == FAST["max_velocity"]
        host.port.write(
            apt.mot_set_homeparams(
                **motor, home_dir=2, limit_switch=1, home_velocity=1_000_000, offset_distance=0
            )
        )
        assert host.ask(apt.mot_move_home(**motor), "mot_move_homed").source == dest
        completed = host.ask(apt.mot_move_absolute(**motor, position=50_000), "mot_move_completed")
        assert completed.position == 50_000
        host.port.write(
            apt.mot_set_jogparams(
                **motor, jog_mode=2, step_size=2_000, min_velocity=0, **FAST, stop_mode=2
            )
        )
        jogged = host.ask(apt.mot_move_jog(**motor, direction=1), "mot_move_completed")
        assert jogged.position == 52_000
        assert stands_at(served)[bay] == "52000 counts"
        host.port.write(apt.mot_move_velocity(**motor, direction=2))
        stopped = host.ask(apt.mot_move_stop(**motor, stop_mode=1), "mot_move_stopped")
        assert stands_at(served)[bay] == f"{stopped.position} counts"
        counter = host.ask(apt.mot_req_poscounter(**motor), "mot_get_poscounter")
        assert counter.position == stopped.position
    assert served.link.received


def test_thorlabs_apt_protocol_reads_the_identity_that_was_given() -> None:
    """A client for a later issue still reads the hardware version that follows the stage id."""
    identity = {"model": "KDC101", "serial_number": 27_000_001, "hardware_type": 16, "stage_id": 7}
    with (
        virtual.TDC001(**identity) as controller,
        controller.tcp() as served,
        closing(Host(served.url)) as host,
    ):
        info = host.ask(apt.hw_req_info(dest=USB, source=HOST), "hw_get_info")
    assert (info.serial_number, info.type) == (27_000_001, 16)
    assert info.model_number.rstrip(b"\0") == b"KDC101"
    assert (info.hw_version, info.mod_state, info.nchs) == (0, 0, 1)
