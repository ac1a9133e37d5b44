"""``stagewire panel``: its keys, dialogues and refusals, and the stop that overtakes everything."""

from __future__ import annotations

import builtins
import sys
import threading
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from panel_links import LONG, Shown, shown, shows
from textual import events
from textual.widgets import Input

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.panel import axis as axis_module
from stagewire_cli.panel import session
from stagewire_cli.panel.amounts import travel_of
from stagewire_cli.panel.card import AxisCard
from stagewire_cli.panel.session import Line

if TYPE_CHECKING:
    from conftest import Stagewire

Z8 = "virtual://TDC001?stage=Z8&serial_number=83000001"
OTHER = "virtual://TDC001?stage=Z8&serial_number=83000002"
ON_Z8 = {"unit": ["TDC001"], "stage": ["Z8"], "travel": ["12"]}
Monkey = pytest.MonkeyPatch


def hold(panel: Shown, key: str) -> None:
    """Send a key as its repetition does, without waiting for the panel."""
    panel.app._driver.send_message(events.Key(key, None))  # type: ignore[union-attr]


async def go_to(panel: Shown, text: str) -> None:
    await panel.press("g", *text, "enter")


# Watching


@shows
async def test_opening_and_watching_writes_no_setting_and_moves_nothing(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        [link] = panel.links
        before = len(link.written)
        await panel.until(lambda: len(link.written) > before + 20)
        kinds = {name.split("_")[1] for name in link.sent()}
    assert kinds <= {"REQ", "ACK"}


@shows
async def test_a_look_that_is_late_at_the_end_finds_no_screen_and_raises_nothing(
    monkey: Monkey,
) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        pass
    panel.app._look()


@shows
async def test_the_screen_shows_position_travel_and_state_of_each_axis(monkey: Monkey) -> None:
    options = {**ON_Z8, "travel": ["12", "-5,5"]}
    async with shown(monkey, Z8, OTHER, **options) as panel:
        text = await panel.text()
    assert "▶ TDC001 83000001 0.0000 mm 0 ◆─" in text
    assert "12 mm ○ at rest not homed · enabled · step 0.1 mm" in text
    assert "TDC001 83000002 0.0000 mm -5 ─" in text
    assert "SPACE stops all axes" in text


@shows
async def test_without_a_stage_the_unit_is_counts(monkey: Monkey) -> None:
    async with shown(monkey, Z8, unit=["TDC001"]) as panel:
        assert "0 counts" in await panel.text()
        await panel.press("plus", "right")
        await panel.until(lambda: "at 10000 counts" in panel.axes[0].view.note)
        assert panel.links[0].moves() == ["MOT_MOVE_RELATIVE"]


@shows
async def test_the_bays_of_a_rack_are_axes_that_stop_together(monkey: Monkey) -> None:
    async with shown(monkey, "virtual://BBD102", unit=["BBD102"], stage=["DDS220"]) as panel:
        [link] = panel.links
        names = [axis.name.split()[-2:] for axis in panel.axes]
        await panel.press("space")
        await panel.until(lambda: link.stops() == 2)
    assert names == [["bay", "1"], ["bay", "2"]]


@shows
async def test_an_axis_of_an_ms2000_jogs_without_a_message_for_distances(monkey: Monkey) -> None:
    async with shown(monkey, "virtual://MS2000", unit=["MS2000"]) as panel:
        assert panel.axes[0].name == "MS2000 axis X"
        await panel.press("right")
        await panel.until(lambda: "at 100.0000 um" in panel.axes[0].view.note)
        await panel.press("down", "left")
        await panel.until(lambda: "at -100.0000 um" in panel.axes[1].view.note)


@shows
async def test_keys_without_a_message_are_refused_with_a_reason(monkey: Monkey) -> None:
    async with shown(monkey, "virtual://MS2000", unit=["MS2000"]) as panel:
        await panel.press("h")
        assert "home: this controller has no message for it" in await panel.text()
        await panel.press("e")
        assert "enable: this controller has no message for it" in await panel.text()


@shows
async def test_an_empty_bay_is_left_out_and_named(monkey: Monkey) -> None:
    url = "virtual://BBD103?empty_bays=2"
    async with shown(monkey, url, unit=["BBD103"], size=(100, 30)) as panel:
        assert [axis.name.split()[-1] for axis in panel.axes] == ["1", "3"]
        assert "no answer when opened: BBD103" in await panel.text()


# Motions


@shows
async def test_a_typed_position_is_reached(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        await go_to(panel, "0.2mm")
        await panel.until(lambda: "at 0.2000 mm" in panel.axes[0].view.note)
        assert panel.links[0].moves() == ["MOT_MOVE_ABSOLUTE"]


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("13", "13 mm is outside the travel, 0 to 12 mm; nothing was sent"),
        ("-1", "-1 mm is outside the travel, 0 to 12 mm; nothing was sent"),
        ("1e", "expected a number in mm, not '1e'"),
        ("3deg", "expected a number in mm, not '3deg'"),
    ],
)
def test_a_position_that_is_refused_moves_nothing(
    monkeypatch: Monkey, typed: str, said: str
) -> None:
    @shows
    async def refused(monkey: Monkey) -> None:
        async with shown(monkey, Z8, **ON_Z8) as panel:
            await go_to(panel, typed)
            await panel.until(lambda: panel.axes[0].view.failed)
            assert said in await panel.text()
            assert panel.links[0].moves() == []

    refused(monkeypatch)


@pytest.mark.parametrize(("key", "sent"), [("y", ["MOT_MOVE_HOME"]), ("enter", ["MOT_MOVE_HOME"]),
                                           ("n", []), ("x", []), ("escape", [])])  # fmt: skip
def test_homing_requires_a_confirmation(monkeypatch: Monkey, key: str, sent: list[str]) -> None:
    @shows
    async def homing(monkey: Monkey) -> None:
        async with shown(monkey, Z8, **ON_Z8) as panel:
            await panel.press("h")
            assert "Home TDC001 83000001?" in await panel.text()
            assert panel.links[0].moves() == []
            await panel.press(key)
            if sent:
                await panel.until(lambda: panel.links[0].moves() == sent)
            else:
                await panel.rest()
            assert panel.links[0].moves() == sent

    homing(monkeypatch)


@shows
async def test_a_channel_is_disabled_and_enabled_after_a_confirmation(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        [link] = panel.links
        await panel.press("e")
        assert "MOD_SET_CHANENABLESTATE" not in link.sent()
        await panel.press("y")
        await panel.until(lambda: panel.axes[0].view.enabled is False)
        await panel.until(lambda: not panel.axes[0].view.action)
        assert "disabled" in await panel.text()
        await panel.press("e", "y")
        await panel.until(lambda: panel.axes[0].view.enabled is True)


@shows
async def test_a_jog_beyond_the_travel_is_refused(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        await panel.press("left")
        await panel.until(lambda: panel.axes[0].view.failed)
        assert "is outside the travel, 0 to 12 mm; nothing was sent" in await panel.text()
        assert panel.links[0].moves() == []


@pytest.mark.parametrize(
    ("described", "unit", "travel"),
    [
        ("  travel: -5 to 5 mm (set by travel_mm)", "mm", ((-5, 5), "-5 to 5 mm")),
        ("  travel: -1 to 1 mm (set by travel_mm)", "um", ((-1000, 1000), "-1000 to 1000 um")),
        ("  limits of the controller: 0 to 110 mm after homing (X)", "mm", ((0, 110), "0 to 110 mm")),
        ("  limits of the controller: 0 to 9 counts (X)", "counts", ((0, 9), "0 to 9 counts")),
        ("  travel: 25 mm (Z825B, the vendor)", "mm", (None, "25 mm long, ends unknown")),
        ("  travel: endless (PRM1_Z8, the vendor)", "deg", (None, "endless")),
        ("  travel: unknown; not checked", "mm", (None, "unknown")),
    ],
)  # fmt: skip
def test_the_travel_is_that_of_the_library(described: str, unit: str, travel: object) -> None:
    assert travel_of(described, unit) == travel


@shows
async def test_the_step_of_a_jog_is_chosen_in_the_unit_of_the_stage(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        await panel.press("minus")
        assert "step 0.01 mm" in await panel.text()
        await panel.press("plus", "plus", "plus", "plus", "plus")
        assert "step 10 mm" in await panel.text()


# Held keys


@shows
async def test_keys_that_repeat_during_a_step_are_dropped(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        [link], [axis] = panel.links, panel.axes
        for _ in range(40):
            hold(panel, "right")
        await panel.until(lambda: len(link.moves()) == 1)
        await panel.until(lambda: "done" in axis.view.note)
        await panel.rest()
        assert axis.view.note.endswith("at 0.1000 mm")
        assert len(link.moves()) == 1


@shows
async def test_a_held_key_moves_again_only_after_a_step_has_ended(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        [link], [axis] = panel.links, panel.axes
        ends = 0
        while len(link.moves()) < 3:
            hold(panel, "right")
            await panel.pilot.pause(0.02)
            ends = max(ends, link.sent().count("MOT_MOVE_RELATIVE"))
        await panel.rest()
        steps = len(link.moves())
        assert axis.view.note.endswith(f"at {steps / 10:.4f} mm")
        polls = len(link.written)
        await panel.until(lambda: len(link.written) > polls + 10)
        assert len(link.moves()) == steps


@shows
async def test_a_key_that_waited_for_the_screen_moves_nothing(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        [axis] = panel.axes
        late = events.Key("right", None)
        late.time -= axis_module.FRESH + 0.01
        panel.app._driver.send_message(late)  # type: ignore[union-attr]
        await panel.pilot.pause()
        assert not axis.view.action
        assert panel.links[0].moves() == []


@shows
async def test_a_key_held_through_a_stop_moves_nothing_until_it_is_released(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        [link], [axis] = panel.links, panel.axes
        await panel.press("plus", "right")
        await panel.until(lambda: len(link.moves()) == 1)
        await panel.press("space")
        await panel.until(lambda: link.stops() >= 1)
        release = time.monotonic() + 2 * axis_module.RELEASE
        while time.monotonic() < release:
            hold(panel, "right")
            await panel.pilot.pause(0.03)
        assert len(link.moves()) == 1
        await panel.rest()
        await panel.until(lambda: time.monotonic() > axis._refused_until)
        await panel.press("right")
        await panel.until(lambda: len(link.moves()) == 2)


# Stops


@shows
async def test_the_stop_key_stops_while_a_position_is_typed(monkey: Monkey) -> None:
    async with shown(monkey, Z8, OTHER, **ON_Z8) as panel:
        await go_to(panel, "10")
        await panel.until(lambda: len(panel.links[0].moves()) == 1)
        await panel.press("g", "5", "space")
        await panel.until(lambda: all(link.stops() >= 1 for link in panel.links))
        await panel.until(lambda: "stopped" in panel.axes[0].view.note)
        assert "Go to position" not in await panel.text()
        await panel.press("enter")
        await panel.rest()
        assert panel.links[0].moves() == ["MOT_MOVE_ABSOLUTE"]


@shows
async def test_the_stop_key_answers_a_question_with_no(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        await panel.press("h", "space")
        await panel.until(lambda: panel.links[0].stops() >= 1)
        assert "Home" not in (await panel.text()).replace("h home", "")
        await panel.press("y", "enter")
        await panel.rest()
        assert panel.links[0].moves() == []


@shows
async def test_the_stop_is_sent_while_the_screen_is_blocked(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        [link] = panel.links
        await go_to(panel, "10")
        await panel.until(lambda: len(link.moves()) == 1)
        blocked, sent = threading.Event(), []

        def keyboard() -> None:
            blocked.wait(LONG)
            hold(panel, "space")

        def draw() -> None:  # the event loop waits until the stop has been sent
            blocked.set()
            sent.append(link.wait(lambda: link.stops() >= 1))

        thread = threading.Thread(target=keyboard)
        thread.start()
        panel.app.call_later(draw)
        await panel.until(lambda: bool(sent))
        thread.join()
        assert sent == [True]


@shows
async def test_the_stop_is_sent_while_another_axis_times_out(monkey: Monkey) -> None:
    async with shown(monkey, Z8, OTHER, **ON_Z8) as panel:
        silent, moving = panel.links
        await panel.press("down")
        await go_to(panel, "10")
        await panel.until(lambda: len(moving.moves()) == 1)
        silent.is_silent = True
        asked = len(silent.written)
        await panel.until(lambda: len(silent.written) > asked)  # it waits for an answer
        await panel.press("space")
        await panel.until(lambda: silent.stops() >= 1 <= moving.stops())
        await panel.until(lambda: "stopped" in panel.axes[1].view.note)
        await panel.until(lambda: bool(panel.axes[0].view.silent))
        assert "? no answer" in await panel.text()


@shows
async def test_a_motion_that_is_still_being_prepared_is_stopped(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        [link], [axis] = panel.links, panel.axes
        start = axis.part.start_move_absolute
        ordered = threading.Event()

        def slowly(**given: Any) -> Any:
            ordered.wait(LONG)
            return start(**given)

        monkey.setattr(axis.part, "start_move_absolute", slowly)
        monkey.setattr(axis_module, "given", lambda call, value, unit: {unit: value})
        await go_to(panel, "10")
        await panel.until(lambda: bool(axis.view.action))
        await panel.press("space")
        await panel.until(lambda: link.stops() >= 1)
        ordered.set()
        await panel.until(lambda: "stopped" in axis.view.note)
        assert [name for name in link.sent() if "MOVE_" in name][-2:] == [
            "MOT_MOVE_ABSOLUTE",
            "MOT_MOVE_STOP",
        ]


@shows
async def test_a_lost_line_leaves_the_other_axes_to_the_stop(monkey: Monkey) -> None:
    async with shown(monkey, Z8, OTHER, **ON_Z8) as panel:
        lost, other = panel.links
        lost.lose()
        await panel.until(lambda: panel.axes[0].view.lost)
        text = await panel.text()
        assert "✗ line lost" in text
        assert "the port was unplugged" in text
        await panel.press("right")
        assert "quit, and start the panel again" in await panel.text()
        await panel.press("down")
        await go_to(panel, "10")
        await panel.until(lambda: len(other.moves()) == 1)
        await panel.press("space")
        await panel.until(lambda: other.stops() >= 1)


@pytest.mark.parametrize("key", ["q", "ctrl+c", "ctrl+q"])
def test_quitting_stops_all_axes(monkeypatch: Monkey, key: str) -> None:
    links: list[Any] = []

    @shows
    async def quit_panel(monkey: Monkey) -> None:
        async with shown(monkey, Z8, OTHER, **ON_Z8) as panel:
            links.extend(panel.links)
            await go_to(panel, "10")
            await panel.until(lambda: len(panel.links[0].moves()) == 1)
            await panel.press(key)
            assert not panel.app.is_running or panel.app._exit

    quit_panel(monkeypatch)
    for link in links:
        assert "MOT_MOVE_STOP" in link.sent()


def test_an_error_of_the_screen_stops_all_axes(monkeypatch: Monkey) -> None:
    links: list[Any] = []

    @shows
    async def fail(monkey: Monkey) -> None:
        async with shown(monkey, Z8, OTHER, **ON_Z8) as panel:
            links.extend(panel.links)
            await go_to(panel, "10")
            await panel.until(lambda: len(panel.links[0].moves()) == 1)
            monkey.setattr(AxisCard, "look", lambda card: 1 / 0)
            await panel.until(lambda: not panel.app.is_running)

    with pytest.raises(ZeroDivisionError):
        fail(monkeypatch)
    for link in links:
        assert "MOT_MOVE_STOP" in link.sent()


# Calls that are refused


def test_without_a_terminal_the_panel_is_refused(stagewire: Stagewire) -> None:
    result = stagewire("panel", Z8)
    assert result.code == 2
    assert "panel needs a terminal" in result.err


def test_without_textual_the_extra_is_named(monkeypatch: Monkey) -> None:
    importing: Callable[..., Any] = builtins.__import__
    terminal = SimpleNamespace(isatty=lambda: True)

    def missing(name: str, *rest: Any) -> Any:
        if name.partition(".")[0] == "textual":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return importing(name, *rest)

    for name in [name for name in sys.modules if name.startswith("stagewire_cli.panel.app")]:
        monkeypatch.delitem(sys.modules, name)
    with monkeypatch.context() as patch:
        for stream in ("stdin", "stdout", "stderr"):
            patch.setattr(sys, stream, terminal)
        patch.setattr(builtins, "__import__", missing)
        with pytest.raises(CalledWronglyError, match=r"pip install 'stagewire\[panel\]'"):
            session.run(Line.each([Z8]))


def test_an_option_is_given_once_or_once_for_each_url() -> None:
    first, second, third = Line.each(
        ["a", "b", "c"], unit=["TDC001"], stage=["Z8", "Z812", "Z825B"], bay=None, travel=["12"]
    )
    assert [line.unit for line in (first, second, third)] == ["TDC001"] * 3
    assert [line.options["stage"] for line in (first, second, third)] == ["Z8", "Z812", "Z825B"]
    assert third.options["travel_mm"] == 12
    with pytest.raises(CalledWronglyError, match="--scale-source is given 2 times for 3 URLs"):
        Line.each(["a", "b", "c"], scale_source=["vendor", "document"])


@pytest.mark.parametrize("name", ["MFF101", "TPZ001"])
def test_a_controller_without_an_axis_that_stops_is_refused(name: str) -> None:
    lines = Line.each([f"virtual://{name}"], unit=[name])
    with (
        pytest.raises(CalledWronglyError, match=f"a {name} has no axis that can be moved"),
        session.opened_axes(lines),
    ):
        pytest.fail("it was opened")


@shows
async def test_digits_that_are_typed_before_the_dialogue_is_drawn_are_kept(monkey: Monkey) -> None:
    async with shown(monkey, Z8, **ON_Z8) as panel:
        [link] = panel.links
        for key in "g15":
            panel.app._driver.send_message(events.Key(key, key))  # type: ignore[union-attr]
        await panel.until(lambda: "PositionEntry" in type(panel.app.screen).__name__)
        await panel.until(lambda: panel.app.screen.query_one(Input).value == "15")
        await panel.press(".", "5")
        assert panel.app.screen.query_one(Input).value == "15.5"
        assert link.moves() == []
