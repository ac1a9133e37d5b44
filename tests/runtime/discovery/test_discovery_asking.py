"""Identification of controllers: requests, answers, and missing answers."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import stagewire
import stagewire_virtual as virtual
from serial_ports import linux, port, show
from stagewire._discovery.identification import used_bays
from stagewire._links import opening, serial_link
from stagewire.discovery import Diagnosis, Verdict, diagnose_computer, diagnose_line, unit_at
from stagewire.errors import BadValueError, LinkOpenError, TransportLostError, WrongUnitError
from stagewire.links import Link, LinkSettings
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_virtual.linking import SteppedLink

INFO_AT = {dest: bytes([0x05, 0, 0, 0, dest, 0x01]) for dest in (0x50, 0x11, 0x22)}


class Silent(Link):
    """A line that is silent or repeats the same bytes; reading advances its clock."""

    def __init__(self, says: bytes = b"", *, is_lost: bool = False) -> None:
        self.url = "silent"
        self.now = 0.0
        self.clock = lambda: self.now
        self.written: list[bytes] = []
        self.closed = False
        self._says = says
        self._is_lost = is_lost

    def read(self, timeout: float) -> bytes:
        if self._is_lost:
            raise TransportLostError("silent: the line is gone")
        self.now += max(timeout, 0.05)
        return self._says

    def write(self, data: bytes) -> None:
        self.written.append(bytes(data))

    write_now = write

    def wake(self) -> None:
        pass

    def close(self) -> None:
        self.closed = True


class Counted(SteppedLink):
    """The line of a virtual controller, which records what was sent."""

    def __init__(self, controller: virtual.VirtualController) -> None:
        super().__init__(controller)
        self.written: list[bytes] = []

    def write(self, data: bytes) -> None:
        self.written.append(bytes(data))
        super().write(data)


OpenLine = Callable[..., Link]


@pytest.fixture
def opens(monkeypatch: pytest.MonkeyPatch) -> Callable[[OpenLine], None]:
    """Return a function that replaces the opening of lines."""
    show(monkeypatch)

    def take(open_line: OpenLine) -> None:
        monkeypatch.setattr(opening, "open_link", open_line)

    return take


def only(told: list[Diagnosis]) -> Diagnosis:
    [one] = told
    assert one.verdict is not Verdict.WRONG or one.advice
    return one


def test_identification_distinguishes_units_of_one_prefix_and_lists_the_bays(
    monkeypatch: pytest.MonkeyPatch, opens: Callable[[OpenLine], None]
) -> None:
    with virtual.BBD103(empty_bays=[2]) as rack:
        line = Counted(rack)
        opens(lambda url: line)
        show(monkeypatch, linux("/dev/ttyUSB0", "73000001"), port("/dev/ttyS0"))
        asked, other = stagewire.discover(ask=True)
    assert (asked.unit, asked.bays, asked.problem) == ("BBD103", (1, 3), "")
    assert asked.identity is not None
    assert asked.identity.firmware == "1.0.0"
    assert asked.serial_number.startswith("73")
    assert other.identity is None
    assert line.written[0] == INFO_AT[0x11]  # a rack is only asked at its own address
    assert len(line.written) == 1 + 3


def test_a_unit_with_its_own_usb_plug_is_asked_only_at_its_address(
    monkeypatch: pytest.MonkeyPatch, opens: Callable[[OpenLine], None]
) -> None:
    with virtual.TDC001() as tdc:
        line = Counted(tdc)
        opens(lambda url: line)
        show(monkeypatch, linux("/dev/ttyUSB0", "83000001"))
        [asked] = stagewire.discover(ask=True)
    assert asked.unit == "TDC001"
    assert line.written == [INFO_AT[0x50]]


@pytest.mark.parametrize(("number", "address"), [("83000001", 0x50), ("73000001", 0x11)])
def test_a_known_unit_that_does_not_answer_is_not_asked_at_other_addresses(
    monkeypatch: pytest.MonkeyPatch,
    opens: Callable[[OpenLine], None],
    number: str,
    address: int,
) -> None:
    line = Silent()
    opens(lambda url: line)
    show(monkeypatch, linux("/dev/ttyUSB0", number))
    [asked] = stagewire.discover(ask=True)
    assert asked.problem == f"no answer to the identity request at {address:#04x}"
    assert line.written == [INFO_AT[address]]


def test_a_report_about_another_bay_is_not_taken_for_the_reply() -> None:
    line = Silent()
    said = iter([m.RackGetBayUsed(1, 1), m.RackGetBayUsed(0, 2), m.RackGetBayUsed(1, 1)])
    line.read = lambda timeout: next(said).pack(dest=0x01, source=0x11)  # type: ignore[method-assign]
    assert used_bays(line, PROTOCOL, 0x11, 2) == (2,)


def test_discovery_continues_after_a_port_that_cannot_be_opened_or_is_lost(
    monkeypatch: pytest.MonkeyPatch, opens: Callable[[OpenLine], None]
) -> None:
    gone = Silent(is_lost=True)

    def open_line(url: str) -> Link:
        if url == "/dev/ttyUSB0":
            raise LinkOpenError(f"{url}: busy")
        return gone

    opens(open_line)
    show(monkeypatch, linux("/dev/ttyUSB0", "83000001"), linux("/dev/ttyUSB1", "80000001"))
    busy, lost = stagewire.discover(ask=True)
    assert (busy.unit, busy.problem) == ("TDC001", "/dev/ttyUSB0: busy")
    assert lost.problem == "silent: the line is gone"
    assert gone.closed


def test_ports_without_the_plug_of_a_controller_are_never_opened(
    monkeypatch: pytest.MonkeyPatch, opens: Callable[[OpenLine], None]
) -> None:
    opens(lambda url, **_: pytest.fail("it was opened"))
    show(
        monkeypatch, port("/dev/ttyS0"), linux("/dev/ttyUSB0", "83000001", pid=0x6001, maker="FTDI")
    )
    assert [one.identity for one in stagewire.discover(ask=True)] == [None, None]
    assert all(one.verdict is not Verdict.FINE for one in diagnose_computer(ask=True))


def test_the_doctor_reports_the_answer_of_a_controller(opens: Callable[[OpenLine], None]) -> None:
    with virtual.BBD102() as rack:
        opens(lambda url, **_: SteppedLink(rack))
        told = only(diagnose_line("/dev/ttyUSB0"))
    assert told.verdict is Verdict.FINE
    assert told.text.startswith("answers: BBD102: Two-channel benchtop")
    assert told.text.endswith("bays with a module: 1, 2")


def test_the_doctor_asks_the_ports_of_controllers_only_on_request(
    monkeypatch: pytest.MonkeyPatch, opens: Callable[[OpenLine], None]
) -> None:
    with virtual.TDC001() as tdc:
        opens(lambda url: SteppedLink(tdc))
        show(monkeypatch, linux("/dev/ttyUSB0", "83000001"), port("/dev/ttyS0"))
        assert len(diagnose_computer()) == 2
        told = diagnose_computer(ask=True)
    assert [one.about for one in told] == ["/dev/ttyUSB0", "/dev/ttyS0", "/dev/ttyUSB0"]
    assert told[-1].text.startswith("answers: TDC001")


def test_the_doctor_reports_a_unit_other_than_the_named_one(
    opens: Callable[[OpenLine], None],
) -> None:
    with virtual.TDC001() as tdc:
        opens(lambda url, **_: SteppedLink(tdc))
        told = only(diagnose_line("/dev/ttyUSB0", "TST001"))
    assert told.verdict is Verdict.WRONG
    assert "the wrong unit answers: TDC001" in told.text
    assert "expected TST001" in told.text


def test_the_doctor_finds_a_wrong_baud_rate(
    opens: Callable[[OpenLine], None],
) -> None:
    tried: list[int | None] = []

    with virtual.TDC001() as tdc:

        def open_line(url: str, baudrate: int | None = None) -> Link:
            tried.append(baudrate)
            return SteppedLink(tdc) if baudrate == 19200 else Silent(b"\xff\x07\xf8")

        opens(open_line)
        told = only(diagnose_line("/dev/ttyUSB0"))
    assert tried == [None, 9600, 19200]
    assert "wrong baud rate: the controller answers at 19200 baud: TDC001" in told.text
    assert "baudrate=19200" in told.advice


@pytest.mark.parametrize(
    ("says", "said"), [(b"", "no answer"), (b"\xff\x07", "bytes without a valid frame")]
)
def test_the_doctor_reports_a_missing_answer(
    opens: Callable[[OpenLine], None], says: bytes, said: str
) -> None:
    made: list[Silent] = []

    def open_line(url: str, baudrate: int | None = None) -> Link:
        made.append(Silent(says))
        return made[-1]

    opens(open_line)
    told = only(diagnose_line("/dev/ttyUSB0"))
    assert told.verdict is Verdict.WRONG
    assert said in told.text
    assert ("baud rate" in told.advice) == bool(says)
    assert "--unit MS2000" in told.advice
    assert len(made) == 5  # at the default rate, and at the four documented rates
    assert all(one.closed for one in made)
    assert all(sent in INFO_AT.values() for one in made for sent in one.written)


def test_a_line_without_a_baud_rate_is_asked_once(opens: Callable[[OpenLine], None]) -> None:
    made: list[Silent] = []

    def open_line(url: str) -> Link:
        made.append(Silent())
        return made[-1]

    opens(open_line)
    only(diagnose_line("socket://127.0.0.1:9"))
    assert len(made) == 1
    assert made[0].written == [INFO_AT[0x50], INFO_AT[0x11]]


def test_the_doctor_reports_a_line_that_cannot_be_opened(opens: Callable[[OpenLine], None]) -> None:
    def open_line(url: str, **_: object) -> Link:
        raise LinkOpenError(f"{url}: port not found")

    opens(open_line)
    [told] = diagnose_line("/dev/ttyUSB7")
    assert (told.verdict, told.text) == (Verdict.WRONG, "port not found")


def test_the_doctor_refuses_an_unknown_unit() -> None:
    with pytest.raises(BadValueError, match="did you mean TDC001"):
        diagnose_line("/dev/ttyUSB0", "TDC01")


def test_unit_at_uses_the_url_or_the_plug_before_it_opens_a_line(
    monkeypatch: pytest.MonkeyPatch, opens: Callable[[OpenLine], None]
) -> None:
    opens(lambda url, **_: pytest.fail("it was opened"))
    show(monkeypatch, linux("/dev/ttyUSB0", "80000001"), linux("/dev/ttyUSB1", "27000001"))
    assert unit_at("virtual://tdc001?stage=Z8") == "TDC001"
    assert unit_at("/dev/ttyUSB0") == "TST001"
    assert unit_at("/dev/ttyUSB1") == "KDC101"


def test_unit_at_requests_the_identity_if_nothing_else_is_known(
    opens: Callable[[OpenLine], None],
) -> None:
    with virtual.BSC103() as rack:
        opens(lambda url, **_: SteppedLink(rack))
        with pytest.raises(WrongUnitError, match="no answer to the identity request at 0x50"):
            unit_at("socket://127.0.0.1:9")  # a rack is never asked by a guess
        assert unit_at("socket://127.0.0.1:9", serial_number=70000001) == "BSC103"
    with virtual.rack(None, "MPZ601") as modules:
        line = Counted(modules)
        opens(lambda url, **_: line)
        assert unit_at("socket://127.0.0.1:9", bay=2) == "MPZ601"
        assert line.written[-1] == INFO_AT[0x22]


def test_unit_at_raises_an_error_if_the_unit_cannot_be_determined(
    opens: Callable[[OpenLine], None],
) -> None:
    opens(lambda url, **_: Silent())
    with pytest.raises(WrongUnitError, match=r"give the name of its unit \(unit=\'TDC001\'"):
        unit_at("/dev/ttyUSB0")
    with virtual.rack("MPZ601") as modules:
        opens(lambda url, **_: SteppedLink(modules))
        with pytest.raises(WrongUnitError, match="only by its name or with bay="):
            unit_at("/dev/ttyUSB0")


def test_a_controller_of_commands_is_asked_at_every_rate_of_its_switches(
    opens: Callable[[OpenLine], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[int] = []

    with virtual.MS2000() as ms2000:

        def open_serial(url: str, settings: LinkSettings) -> Link:
            tried.append(settings.baudrate)
            return SteppedLink(ms2000) if settings.baudrate == 28800 else Silent()

        monkeypatch.setattr(serial_link, "open_serial", open_serial)
        told = only(diagnose_line("COM3", "MS2000"))
    assert tried == [9600, 19200, 28800]
    assert told.verdict is Verdict.FINE
    assert told.text == "answers: MS2000, axis X: EMOT at 28800 baud: open it with baudrate=28800"


def test_the_doctor_reports_a_missing_answer_of_a_controller_of_commands(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    show(monkeypatch)
    monkeypatch.setattr(serial_link, "open_serial", lambda url, settings: Silent())
    told = only(diagnose_line("COM3", "MS2000"))
    assert told.verdict is Verdict.WRONG
    assert "tried: 9600, 19200, 28800, 115200 baud" in told.text


def reporting(controller: virtual.VirtualController, number: int, model: bytes) -> Counted:
    """Return a line to a controller that reports this serial number and this model."""
    line = Counted(controller)
    read = line.read

    def twisted(timeout: float) -> bytes:
        data = read(timeout)
        if data[:2] != b"\x06\x00":
            return data
        return data[:6] + number.to_bytes(4, "little") + model.ljust(8, b"\0") + data[18:]

    line.read = twisted  # type: ignore[method-assign]
    return line


@pytest.mark.parametrize(
    ("number", "model", "unit"),
    [
        (70000001, b"BSC103", "BSC103"),
        (70000001, b"BSC203", "BSC203"),
        (70000001, b"SCC201", "BSC203"),
    ],
)
def test_the_reported_model_decides_between_units_of_one_prefix(
    opens: Callable[[OpenLine], None], number: int, model: bytes, unit: str
) -> None:
    with virtual.BSC103() as rack:
        opens(lambda url, **_: reporting(rack, number, model))
        assert unit_at("socket://127.0.0.1:9", serial_number=number) == unit


def test_units_of_one_class_can_be_opened_without_a_model(
    opens: Callable[[OpenLine], None],
) -> None:
    with virtual.TDC001() as tdc:
        opens(lambda url, **_: reporting(tdc, 83000001, b""))
        assert unit_at("socket://127.0.0.1:9") == "TDC001"
    with virtual.BSC101() as bsc:
        opens(lambda url, **_: reporting(bsc, 40000001, b""))
        with pytest.raises(WrongUnitError, match="BSC101 or BSC201: they share the prefix"):
            unit_at("socket://127.0.0.1:9")
    with virtual.BSC103() as rack:
        opens(lambda url, **_: reporting(rack, 70000001, b""))
        with pytest.raises(WrongUnitError, match="the reported model does not show which it is"):
            # A BSC102 is also possible: its prefix is unknown.
            unit_at("socket://127.0.0.1:9", serial_number=70000001)


@pytest.mark.parametrize(
    ("number", "model"), [(83000001, b"KVS30"), (24000001, b"TDC001"), (83000001, b"TST001")]
)
def test_a_serial_number_and_a_model_that_contradict_each_other_match_no_unit(
    monkeypatch: pytest.MonkeyPatch, opens: Callable[[OpenLine], None], number: int, model: bytes
) -> None:
    with virtual.TDC001() as tdc:
        opens(lambda url, **_: reporting(tdc, number, model))
        with pytest.raises(WrongUnitError, match=f"{model.decode()}: no known unit .*{number}"):
            unit_at("socket://127.0.0.1:9")
        show(monkeypatch, linux("/dev/ttyUSB0", str(number)))
        [asked] = stagewire.discover(ask=True)
    assert asked.unit is None
    assert "no known unit reports this model" in asked.what
