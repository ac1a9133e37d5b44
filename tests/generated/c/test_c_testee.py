"""The C testee answers like the Python testee, and survives any line."""

from __future__ import annotations

import itertools
import json
import re
import shlex
import subprocess
import sysconfig
import threading
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import jsonschema_rs
import pytest
from testee_calls import SCHEMA  # in tests/conformance
from testee_requests import broken_lines, decoding, encodings, streams
from testees import (
    PROTOCOLS,
    SANITIZERS,
    VERSION,
    Json,
    Program,
    Testees,
    build,
    lines,
    sources,
)
from toolchain import (
    C_WARNINGS,
    C,
    Package,
    compiles,
    need,
    of_each_package,
    packages,
)

from checkout import ROOT, SMALL_SPECS
from files import write_files
from parts import first_of
from stagewire.protocols import FORMS, load_protocol
from stagewire_conformance.registry import registry_of
from stagewire_conformance.testee import MAXIMUM_LINE
from stagewire_generator import check, render

SEED = 20250317
EACH = 12  # messages per layout
STREAMS = 2500
BROKEN = 4000
KEYS = ("dest", "source", "axis", "extra", "form", "data", "kind", "direction", "context")

ANSWER = jsonschema_rs.validator_for({"$ref": "#/$defs/answer", "$defs": SCHEMA["$defs"]})
Ask = Callable[[bytes], list[Json]]
of_each_protocol = pytest.mark.parametrize("name", PROTOCOLS.values())


def requests_of(name: str, requests: Any) -> list[Json]:
    return [{"id": i, "protocol": name, **request} for i, request in enumerate(requests)]


def cases_of(name: str) -> list[Json]:
    """Return the cases of the vectors."""
    cases: list[Json] = load_protocol(name).vectors()["cases"]
    return cases


def frames_of(name: str, rng: Random) -> list[bytes]:
    """Return the bytes of valid messages, including undocumented ones."""
    found = [case["answer"].get("hex") for case in cases_of(name)]
    decoded = [case["request"].get("hex") for case in cases_of(name) if case["answer"]["ok"]]
    return [bytes.fromhex(raw) for raw in (*found, *decoded) if raw]


def ask_python(testees: Testees) -> Ask:
    return lambda text: [testees.python.answer(line) for line in text.splitlines()]


# Messages


@of_each_package
def test_hello(package: Package, testees: Testees) -> None:
    [answer] = testees.program(PROTOCOLS[package.name]).ask(
        b'{"id":"\\u00e9\\ud800","op":"hello"}\n'
    )
    assert answer == {
        "id": "é\ud800",
        "ok": True,
        "testee": 1,
        "implementation": "stagewire-c",
        "version": "0",
        "protocols": [PROTOCOLS[package.name]],
        "operations": ["hello", "decode", "encode", "stream"],
    }


@of_each_protocol
def test_every_case_of_the_vectors(name: str, testees: Testees) -> None:
    cases = cases_of(name)
    assert len(cases) > 1000
    answers = testees.program(name).ask(
        lines(requests_of(name, [case["request"] for case in cases]))
    )
    for case, answer in zip(cases, answers, strict=True):
        assert ANSWER.is_valid(answer), answer
        said = {key: value for key, value in answer.items() if key not in ("id", "detail")}
        assert said == case["answer"], case["id"]


@pytest.mark.matrix
@pytest.mark.parametrize("spec", ["good_spec", "good_layouts", "good_commands"])
def test_every_case_of_test_protocols(spec: str, tmp_path: Path) -> None:
    [protocol] = check(SMALL_SPECS / spec)
    write_files(tmp_path, render([protocol], ["c", "c-tests", "vectors"]))
    vectors = json.loads((tmp_path / f"vectors/{protocol.name}.json").read_text(encoding="utf-8"))
    cases = vectors["cases"]
    program = build(Package(tmp_path / "c" / protocol.package), tmp_path)
    requests = requests_of(protocol.name, [case["request"] for case in cases])
    answers = Program(protocol.name, [program]).ask(lines(requests))
    for case, answer in zip(cases, answers, strict=True):
        said = {key: value for key, value in answer.items() if key not in ("id", "detail")}
        assert said == case["answer"], case["id"]


@pytest.mark.parametrize("way", ["from C to Python", "from Python to C"])
@of_each_protocol
def test_each_testee_decodes_the_bytes_of_the_other(name: str, way: str, testees: Testees) -> None:
    tellers = [testees.program(name).ask, ask_python(testees)]
    encoder, decoder = tellers if way == "from C to Python" else reversed(tellers)
    wanted = list(encodings(Random(SEED), load_protocol(name), EACH))
    encode = [{"op": "encode", **request} for request, _ in wanted]
    encoded = encoder(lines(requests_of(name, encode)))
    assert all(answer["ok"] for answer in encoded), next(a for a in encoded if not a["ok"])
    decode = [
        decoding(load_protocol(name), said, answer["hex"])
        for (_, said), answer in zip(wanted, encoded, strict=True)
    ]
    decoded = decoder(lines(requests_of(name, decode)))
    for i, ((_, said), answer) in enumerate(zip(wanted, decoded, strict=True)):
        assert answer == {"id": i, "ok": True, **said}


@of_each_protocol
def test_both_encode_all_values_of_a_field_alike(name: str, testees: Testees) -> None:
    rng = Random(SEED)
    odd = [None, True, False, 1.0, 1e300, -0.0, "", "x", "\0", "é", "Ā", "\ud800", "zz", "00", [], {}, -1,
           2**7, 2**8, 2**15, 2**16, 2**23, 2**31, 2**32, 2**63, 2**64, -(2**63) - 1, 10**400]  # fmt: skip
    asked = []
    for request, _ in encodings(rng, load_protocol(name), 4):
        changed = {"op": "encode", **request, "fields": dict(request["fields"])}
        for _ in range(rng.choice((1, 1, 2))):
            holder = rng.choice([changed, changed["fields"]]) if changed["fields"] else changed
            key = rng.choice(KEYS if holder is changed else list(holder))
            if rng.random() < 0.2:
                holder.pop(key, None)
            else:
                holder[key] = rng.choice(odd)
        asked.append(changed)
    answers = testees.compare(lines(requests_of(name, asked)))
    codes = {answer.get("error") for answer in answers}
    assert codes >= {"bad_value", "out_of_range", "missing_field", "bad_request", "bad_length"}


@of_each_protocol
def test_both_support_the_same_forms(name: str, testees: Testees) -> None:
    protocol = load_protocol(name)
    forms = {cls.layout.form for cls in protocol.messages} | {*FORMS, "", "data:ac"}
    told: list[Json] = [
        {},
        {"context": {"status": "dc"}},
        {"dest": 1, "source": 2, "data": "00" * 20},
    ]
    told += [{"direction": "reply"}, {"direction": "command", "axis": 24}, {"kind": "setup"}]
    names = {cls.layout.message for cls in protocol.messages}
    asked = [
        {"op": "encode", "message": message, **({} if form is None else {"form": form}), **more}
        for message in sorted(names | {"MOT_SET_MOVEVELPARAMS", "NOBODY"})
        for form in [None, *sorted(forms)]
        for more in told
    ]
    codes = {answer.get("error") for answer in testees.compare(lines(requests_of(name, asked)))}
    assert codes >= {"unknown_message", "bad_length", "missing_field", "bad_value", "bad_request"}


@of_each_protocol
def test_the_first_wrong_field_is_reported(name: str, testees: Testees) -> None:
    asked = []
    protocol = load_protocol(name)
    for request, _ in encodings(Random(SEED), protocol, 1):
        known = registry_of(protocol).fields(request["message"], request["form"])
        given = [field for field in known if field in request["fields"]]
        for pair in itertools.pairwise(given):
            for wrong, other in (pair, reversed(pair)):
                beyond = known[wrong]["maximum"]
                changed = {wrong: "x" if beyond is None else beyond + 1, other: None}
                fields = request["fields"] | changed
                asked.append({"op": "encode", **request, "fields": fields})
    codes = {answer["error"] for answer in testees.compare(lines(requests_of(name, asked)))}
    assert codes == {"bad_value", "out_of_range"}


def test_texts(testees: Testees) -> None:
    info = {"serial_number": 1, "type": 44, "software_version": "00" * 4, "notes": "",
            "hw_version": 1, "mod_state": 0, "nchs": 1}  # fmt: skip
    texts = ["", "é", "ÿ", "\x80", "Ā", "Ƀ", "ࠀ", "😀", "\ud800", "\0", "a\0", "\0a", "a" * 8, "é" * 8,
             "a" * 9, "é" * 9, "a" * 8 + "\0", "a" * 8 + "Ā", "a" * 5000]  # fmt: skip
    request = {"op": "encode", "message": "HW_GET_INFO", "dest": 1, "source": 80}
    asked = [{**request, "fields": {**info, "model_number": text}} for text in texts]
    answers = testees.compare(lines(requests_of("thorlabs_apt", asked)))
    assert {answer.get("error") for answer in answers} == {None, "bad_value", "out_of_range"}


@of_each_protocol
def test_both_parse_damaged_streams_alike(name: str, testees: Testees) -> None:
    rng = Random(SEED)
    asked = streams(rng, load_protocol(name), frames_of(name, rng), STREAMS)
    answers = testees.compare(lines(requests_of(name, asked)))
    events = {event["event"] for answer in answers for event in answer["events"]}
    assert events >= {"message", "garbage", "unknown", "bad_length"}


# Lines


@of_each_protocol
def test_both_accept_the_same_json(name: str, testees: Testees) -> None:
    rng = Random(SEED)
    requests = requests_of(
        name, itertools.islice((case["request"] for case in cases_of(name)), 0, None, 17)
    )
    answers = testees.compare(b"\n".join(broken_lines(rng, requests, BROKEN)))
    assert {answer["ok"] for answer in answers} == {True, False}


@pytest.mark.parametrize(
    "line",
    [
        b'{"id":1,"op":"hello","x":' + b"[" * 400 + b"]" * 400 + b"}",
        b"[" * 100_000 + b"]" * 100_000,
        b'{"id":' + b"9" * 4300 + b',"op":"hello"}',
        b'{"id":' + b"9" * 4301 + b',"op":"hello"}',
        b'{"id":-' + b"9" * 4300 + b',"op":"hello"}',
        b'{"id":-0,"op":"hello"}',
        b'{"id":1,"op":"hello","x":' + b"9" * 5000 + b".0}",
        b'{"id":"\\u0000\\"\\\\\\/\\b\\f\\n\\r\\t\x7f","op":"hello"}',
        b'{"\\u0069d":1,"\\u006fp":"hello"}',
        b'{"id":1,"op":"hello","\\u0069d":2}',
        b'{"id":1,"op":"hello","x":{"\\ud83d\\ude00":1,"\xf0\x9f\x98\x80":2}}',
        b'{"id":"\\ud83d\\ude00 \\ude00\\ud83d \\ud83dx \\ud83d\\n","op":"hello"}',
        b'{"id":"\\ud83d\\ud83d\\ude00","op":"hello"}',
        b'{"id":"\xed\xa0\xbd","op":"hello"}',
        b'{"id":"\xc0\xaf","op":"hello"}',
        b'{"id":"\xf4\x90\x80\x80","op":"hello"}',
        b'{"id":"\xe2\x82',
        b'\r{"id":1,\t"op" : "hello"} \r',
        b'\x0b{"id":1,"op":"hello"}',
        b'{"id":1,"op":"hello"}\x00',
        b'{"id":1,"op":"he\x00llo"}',
        b'{"id":1,"op":"hello",}',
        b'{"id":1 "op":"hello"}',
        b"{'id':1,'op':'hello'}",
        b'{"id":1,"op":"hello"',
        b'{"id":1,"op":"hello\\',
        b'{"id":1,"op":"hello\\u12',
        b'{"id":1,"op":"hello\\U0041"}',
        b'{"id":1,"op":"hello"]',
        b'{1:1,"id":1,"op":"hello"}',
        b'{"id":1,"op":"hello","x":+1}',
        b'{"id":1,"op":"hello","x":1.}',
        b'{"id":1,"op":"hello","x":.5}',
        b'{"id":1,"op":"hello","x":1e}',
        b'{"id":1,"op":"hello","x":-}',
        b'{"id":1,"op":"hello","x":-Infinity}',
        b'{"id":1,"op":"hello","x":1e999}',
        b'{"id":1,"op":"hello","x":TRUE}',
        b'{"id":1,"op":"hello","x":tru}',
        b'{"id":1,"op":"hello"}//',
        b'{"id":1,"op":"decode","protocol":"thorlabs_apt","hex":"53040600D0010100400D0300"}',
        b'{"id":1,"op":"decode","protocol":"thorlabs_apt","hex":"53040600d0010100400d030"}',
        b'{"id":1,"op":"decode","protocol":"thorlabs_apt","hex":"\\u00353040600d0010100400d0300"}',
        b'{"id":1,"op":"decode","protocol":"thorlabs_apt","hex":"53\\u00000"}',
        b'{"id":1,"op":"decode","protocol":"thorlabs_apt\\u0000","hex":"53"}',
    ],
    ids=itertools.count(),
)
def test_lines_at_the_edge_of_json(line: bytes, testees: Testees) -> None:
    hello = b'{"id":2,"op":"hello"}'
    assert [answer["id"] for answer in testees.compare(line + b"\n" + hello)][-1] == 2


@pytest.mark.matrix
def test_lines_of_any_length(testees: Testees) -> None:
    hello = b'{"id":1,"op":"hello"}'
    longest = hello + b" " * (MAXIMUM_LINE - len(hello) - 1) + b"\n"
    keys = ",".join(f'"{i}":{i}' for i in range(200_000)).encode()
    text = b"".join([
        longest,
        b" " + longest,
        hello + b"\n",
        b" " * (2 * MAXIMUM_LINE) + b"\n",
        b'{"id":2,"op":"hello","x":{' + keys + b"}}\n",
        b'{"id":2,"op":"hello","x":{' + keys + b',"77":1}}\n',
        b'{"id":2,"op":"hello","x":[' + b"1," * 500_000 + b"1]}\n",
        b"\n\n",
        hello,
    ])  # fmt: skip
    found = [(answer["id"], answer["ok"]) for answer in testees.compare(text)]
    refused = (None, False)
    assert found == [
        (1, True), refused, (1, True), refused, (2, False), refused, (2, False), refused, refused, (1, True)
    ]  # fmt: skip


def test_too_deeply_nested_json_is_an_error(testees: Testees) -> None:
    for program in testees.programs:
        for depth, id in ((511, 1), (512, None)):
            line = b'{"id":1,"op":"hello","x":' + b"[" * depth + b"]" * depth + b"}\n"
            [answer] = program.ask(line)
            assert (answer["id"], answer["error"]) == (id, "bad_request")


def test_no_input_gives_no_output(testees: Testees) -> None:
    assert all(program.output(b"") == b"" for program in testees.programs)


def test_a_failed_write_is_a_failure(testees: Testees) -> None:
    for program in testees.programs:
        with open("/dev/full", "wb") as full:
            done = subprocess.run(program.words, input=b"\n\n", stdout=full, check=False)
        assert done.returncode == 1


def test_answers_are_flushed_line_by_line(testees: Testees) -> None:
    for program in testees.programs:
        with subprocess.Popen(
            program.words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdin
            assert process.stdout
            alarm = threading.Timer(60, process.kill)  # otherwise a late answer would hang the test
            alarm.start()
            for id in range(3):
                process.stdin.write(f'{{"id":{id},"op":"hello"}}\n')
                process.stdin.flush()
                assert json.loads(process.stdout.readline() or "{}").get("id") == id
            alarm.cancel()


# The program


def batch(name: str) -> bytes:
    """Return lines of all kinds."""
    rng = Random(SEED)
    requests = requests_of(name, [case["request"] for case in cases_of(name)])
    some = rng.sample(requests, 250)
    cut = requests_of(name, streams(rng, load_protocol(name), frames_of(name, rng), 60))
    deep = [b"[" * 5000, b'{"id":' * 700 + b"1" + b"}" * 700, b'{"id":"\\ud83d\\u', b"\xf0\x9f\x98"]
    return lines(some) + lines(cut) + b"\n".join([*broken_lines(rng, some, 250), *deep])


@pytest.mark.parametrize(
    ("name", "standard"), first_of(itertools.product(("gcc", "clang"), ("c99", "c17")))
)
def test_compilers_give_no_warnings(name: str, standard: str) -> None:
    need(name)
    for package in packages():
        words = [f"-std={standard}", *C_WARNINGS, f"-I{C}", "-fsyntax-only"]
        assert compiles(name, *words, *sources(package)) == ""


@pytest.mark.matrix
@of_each_package
def test_sanitizers_find_nothing(package: Package, testees: Testees, tmp_path: Path) -> None:
    need("clang -fsanitize")
    program = testees.program(PROTOCOLS[package.name])
    built = build(package, tmp_path, *SANITIZERS, VERSION, compiler="clang")
    text = batch(program.protocol)
    assert Program(program.protocol, [built]).output(text) == program.output(text)


@pytest.mark.matrix
@of_each_package
def test_the_index_of_hosts_changes_nothing(
    package: Package, testees: Testees, tmp_path: Path
) -> None:
    """The optimiser also changes nothing: the other testees are built without it."""
    program = testees.program(PROTOCOLS[package.name])
    index = f"-D{package.prefix.upper()}_HOST_INDEX"
    built = build(package, tmp_path, index, "-O2", VERSION)
    text = batch(program.protocol)
    assert Program(program.protocol, [built]).output(text) == program.output(text)


@pytest.mark.matrix
@of_each_package
def test_valgrind_finds_nothing(package: Package, testees: Testees) -> None:
    need("valgrind")
    program = testees.program(PROTOCOLS[package.name])
    words = ["valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full", *program.words]
    text = batch(program.protocol)
    assert Program(program.protocol, words).output(text) == program.output(text)


# The commands are the same for every package, so the smallest one is enough.
SMALLEST = min(packages(), key=lambda package: package.source.stat().st_size)


def test_the_build_command_in_its_header(tmp_path: Path) -> None:
    text = (C / "testing" / "testee" / "testee.h").read_text(encoding="utf-8")
    lines = re.findall(r"^ \*     (\S.*)$", text, re.MULTILINE)
    assert lines[-1].startswith("cc ")
    words = "\n".join(lines).replace("stagewire_apt", SMALLEST.name)
    words = words.replace("-o testee", f"-o {shlex.quote(str(tmp_path / 'testee'))}")
    compiles("sh", "-c", words, cwd=C)
    [answer] = Program("", [tmp_path / "testee"]).ask(b'{"id":1,"op":"hello"}\n')
    assert answer["version"] == "unversioned"


@pytest.mark.matrix
def test_cmake_builds_only_the_library_without_generated_tests(tmp_path: Path) -> None:
    cmake = Path(sysconfig.get_path("scripts")) / "cmake"
    compiles(cmake, "-S", ROOT / "generated" / "c" / SMALLEST.name, "-B", tmp_path)
    compiles(cmake, "--build", tmp_path)
    assert (tmp_path / f"lib{SMALLEST.name}.a").is_file()
    assert not (tmp_path / f"{SMALLEST.name}_testee").exists()


@pytest.mark.matrix
def test_cmake_builds_it(tmp_path: Path) -> None:
    cmake = Path(sysconfig.get_path("scripts")) / "cmake"
    compiles(cmake, "-S", SMALLEST.folder, "-B", tmp_path)
    compiles(cmake, "--build", tmp_path)
    [answer] = Program("", [tmp_path / f"{SMALLEST.name}_testee"]).ask(b'{"id":1,"op":"hello"}\n')
    assert answer["protocols"] == [PROTOCOLS[SMALLEST.name]]
