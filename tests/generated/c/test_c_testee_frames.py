"""Runs all tests of the testee for frames with the C testee, whose answers must be the same."""

from __future__ import annotations

from typing import Any

import pytest
from test_testee import *  # noqa: F403
from testees import VERSION, Program, build, lines, name_of
from toolchain import Package, need

from checkout import ROOT
from stagewire_generator import check, render
from stagewire_generator.output import write

pytestmark = [pytest.mark.usefixtures("asks_both"), pytest.mark.matrix]
APT = "thorlabs_apt"
UNPRINTED = "HW_RICHRESPONSE"


@pytest.fixture(scope="module")
def of_issue_3(tmp_path_factory: pytest.TempPathFactory) -> Program:
    """The C testee of Issue 3 alone, where HW_RICHRESPONSE has no layout; Issue 37 has all layouts."""
    need("gcc")
    folder = tmp_path_factory.mktemp("issue_3")
    write(folder, render(check(ROOT / "spec" / APT, base=True), ["c", "c-tests"]))
    package = Package(folder / "c" / "stagewire_apt")
    build(package, folder, "-O0", VERSION)
    return Program(APT, [folder / name_of(package)])


def asked(program: Program, **request: Any) -> Any:
    [answer] = program.ask(lines([{"id": 1, "protocol": APT, **request}]))
    return answer


@pytest.mark.parametrize(
    "raw", ["810005000150", "810000000150", "81000400815001020304", "810000008150"]
)
def test_a_message_without_a_layout(of_issue_3: Program, raw: str) -> None:
    decoded = asked(of_issue_3, op="decode", hex=raw)
    assert (decoded["message"], decoded["form"]) == (UNPRINTED, "undocumented")
    del decoded["ok"], decoded["id"]
    assert asked(of_issue_3, op="encode", **decoded)["hex"] == raw


@pytest.mark.parametrize(
    ("request_", "error"),
    [
        ({"form": "undocumented"}, "unsupported"),
        ({"data": "00", "fields": {"param1": 1}}, "bad_value"),
    ],
)
def test_refusals_of_values_without_a_layout(
    of_issue_3: Program, request_: dict[str, Any], error: str
) -> None:
    message = {"message": UNPRINTED, "dest": 0x50, "source": 1, "fields": {}, **request_}
    answer = asked(of_issue_3, op="encode", **message)
    assert (answer["ok"], answer["error"]) == (False, error)
