"""The HTML page: well-formed, complete, self-contained, and with everything in it escaped."""

from __future__ import annotations

import hashlib
import itertools
import re
from base64 import b64encode
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from sample_sheets import (
    ANSWERED,
    CAME,
    FAILED,
    HOSTILE,
    NOT_RUN,
    PASSED,
    RULES,
    SIGN,
    SKIPPED,
    hostile,
    sheet,
)

from stagewire_conformance.reports import Fact, Finding, Grade, Sheet, Transmission, as_html
from stagewire_conformance.reports.text import as_text

VOID = {"meta", "br", "link", "img", "hr", "input"}


class Page(HTMLParser):
    """A strictly parsed page: every tag is closed."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[tuple[str, ...], str]] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append((tuple(self.open), data))

    def words(self, *inside: str) -> str:
        """Return all text, or that inside of a tag, with single blanks."""
        found = "".join(
            text
            for path, text in self.texts
            if "style" not in path and all(tag in path for tag in inside)
        )
        return " ".join(found.split())

    def having(self, attribute: str) -> list[str]:
        return [found[attribute] or "" for _, found in self.tags if attribute in found]


def read(made: Sheet) -> Page:
    return Page(as_html(made))


@pytest.mark.parametrize("made", [sheet(), sheet(PASSED), hostile()], ids=["all", "one", "hostile"])
def test_the_page_loads_nothing(made: Sheet) -> None:
    page = read(made)
    assert {tag for tag, _ in page.tags}.isdisjoint(
        {"script", "img", "link", "iframe", "object", "embed", "base", "form", "svg", "input"}
    )
    for attribute in ("src", "srcset", "data", "action", "background", "poster", "style"):
        assert page.having(attribute) == []
    assert all(link.startswith("#") for link in page.having("href"))
    assert not [name for _, found in page.tags for name in found if name.startswith("on")]
    style = next(text for path, text in page.texts if path[-1:] == ("style",))
    assert "url(" not in style
    assert "@import" not in style
    policy = next(f["content"] for _, f in page.tags if "http-equiv" in f) or ""
    digest = b64encode(hashlib.sha256(style.encode()).digest()).decode()
    assert policy.startswith(f"default-src 'none'; style-src 'sha256-{digest}'; ")


@pytest.mark.parametrize("made", [sheet(), hostile()], ids=["all", "hostile"])
def test_links_have_targets_and_ids_are_unique(made: Sheet) -> None:
    page = read(made)
    ids = page.having("id")
    assert len(set(ids)) == len(ids)
    assert {link[1:] for link in page.having("href")} <= set(ids)
    labels = {name for one in page.having("aria-labelledby") for name in one.split()}
    assert labels <= set(ids)


def test_headings_are_in_order_and_tables_have_headers() -> None:
    page = read(sheet())
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(new <= old + 1 for old, new in itertools.pairwise(levels))
    assert dict(page.tags)["html"] == {"lang": "en"}
    # A table of facts has only row headers.
    tables = [f for tag, f in page.tags if tag == "table" and "facts" not in (f.get("class") or "")]
    assert len([tag for tag, _ in page.tags if tag == "thead"]) == len(tables) > 0
    assert all("scope" in found for tag, found in page.tags if tag == "th")


def test_the_contents_of_the_page() -> None:
    words = read(sheet()).words()
    for text in ("FAILED", "does not conform: 1 failed, 1 non-strict", "83000001", "ab" * 32):
        assert text in words
    for case in sheet().cases():
        assert case.id in words
        assert case.title in words
    for rule in RULES:
        assert rule.id in words
        assert rule.states in words or rule.for_host
    assert NOT_RUN.why in words
    assert SKIPPED.why in words
    assert "nobody looks" in words  # the waiver
    assert "A byte line" in words  # the erratum
    assert "p99_ms 3.25" in words
    assert "unsupported: no potentiometer" in words


def test_a_partial_run_lists_only_the_subjects_of_its_cases() -> None:
    whole, some = (read(sheet(PASSED, unselected=number)).words() for number in (0, 5))
    matrix = some.partition("Rules and verdicts The rules")[2].partition("Findings")[0]
    assert "MOT_REQ_POTPARAMS" in whole
    assert "MOT_REQ_POTPARAMS" not in some
    assert "velocity-parameters" in whole
    assert "page 9" in matrix
    assert "page 30" not in matrix
    assert "request-answered" in matrix
    assert "velocity-parameters" not in matrix


def test_without_a_run_there_are_no_results() -> None:
    assert "#results" in read(sheet(PASSED)).having("href")
    page = read(sheet(NOT_RUN))
    assert "#results" not in page.having("href")


def test_a_failure_has_its_bytes_its_dialogue_and_its_command() -> None:
    page = read(sheet(FAILED))
    article = page.words("article")
    finding = FAILED.findings[0]
    assert finding.text in article
    assert isinstance(finding.wanted, bytes)
    assert " ".join(" ".join(as_text(finding.wanted, CAME)).split()) in article
    assert page.words("article", "mark") == "0102--02"
    assert SIGN.raw.hex(" ").upper() in article
    assert "MOT_GET_VELPARAMS chan_ident=2" in article
    assert FAILED.repeat in article
    assert f"Restored: {FAILED.restored[0]}" in article


def test_a_passed_check_has_one_line_without_bytes() -> None:
    noted = Finding(grade=Grade.PASSED, text="99 % of the replies arrived within 2 ms")
    page = read(sheet(replace(PASSED, findings=(noted,), figures={"p99_ms": 2.0})))
    assert PASSED.id in page.words()
    assert noted.text not in page.words()
    assert "p99_ms" not in page.words()
    assert ANSWERED.raw.hex(" ").upper() not in page.words()


def test_the_summary_names_vendor_product_revision_and_tester() -> None:
    empty = read(sheet(PASSED)).words().partition("Declaration of the vendor")[0]
    assert "Vendor not stated" in empty
    facts = (
        Fact(key="certificate_vendor", label="Vendor", value="Example Optics"),
        Fact(key="certificate_revision", label="Revision", value="board C, firmware 1.3"),
        Fact(key="certificate_tester", label="Tester", value="A. Tester"),
        Fact(key="unit", label="Unit", value="TDC001"),
    )
    page = read(sheet(PASSED, facts=facts))
    words = page.words().partition("Declaration of the vendor")[0]
    for text in (
        "Vendor Example Optics",
        "Product TDC001",
        "Revision board C, firmware 1.3",
        "Tester A. Tester",
        "Place and date Name Signature A. Tester",
        "Complete run",
    ):
        assert text in words


def test_the_declaration_is_shown() -> None:
    declared = (Fact(key="u", label="Unsupported: no potentiometer", value="MOT_REQ_POTPARAMS"),)
    assert "There is no PICS" in read(sheet(PASSED)).words()
    words = read(sheet(PASSED, declaration=declared)).words()
    assert "Unsupported: no potentiometer MOT_REQ_POTPARAMS" in words


def test_the_page_of_an_unfinished_run_states_the_reason() -> None:
    words = read(sheet(PASSED, unfinished="the plug was pulled")).words()
    assert "NOT FINISHED" in words
    assert "the plug was pulled" in words
    assert "not run" not in words.partition("Summary")[0]


def test_text_from_a_controller_stays_text() -> None:
    text = as_html(hostile())
    page = Page(text)
    assert "<script" not in text
    assert "{{" in text  # unchanged: not evaluated as a template
    assert not [c for c in text if not c.isprintable() and c != "\n"]
    shown = "<script>alert(1)</script>\\x1b[2J\\x00\\u202e\\n]]>&\"'{{ 7*7 }}"
    assert shown in page.words()
    assert HOSTILE not in text


def test_a_long_dialogue_is_shortened_with_a_note() -> None:
    many = tuple(
        Transmission(time=float(n), sent=n % 2 == 0, raw=bytes([n % 256, n // 256]))
        for n in range(1000)
    )
    words = read(sheet(*(replace(case, lines=many) for case in (PASSED, FAILED)))).words()
    assert words.count("lines omitted here") == 1  # a passed check has no dialogue
    assert "880 lines omitted here" in words
    assert "00 00" in words
    assert "E7 03" in words


def luminance(colour: str) -> float:
    channels = (int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5))
    red, green, blue = (
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels
    )
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def test_every_colour_has_enough_contrast() -> None:
    style = next(text for path, text in read(sheet()).texts if path[-1:] == ("style",))
    themes = [
        dict(re.findall(r"--([a-z-]+): (#[0-9a-f]{6})", block))
        for block in re.findall(r":root \{(.*?)\}", style, re.DOTALL)
    ]
    assert len(themes) == 3  # light, dark, paper
    for theme in themes:
        pairs = [(ink, ground) for ink in ("ink", "soft", "link") for ground in ("paper", "ground")]
        pairs += [(tone, f"{tone}-ground") for tone in ("good", "bad", "odd", "note", "out")]
        pairs += [(tone, "paper") for tone in ("good", "bad", "odd", "note", "out")]
        pairs += [("ink", "mark")]
        for ink, ground in pairs:
            one, other = sorted((luminance(theme[ink]), luminance(theme[ground])))
            assert (other + 0.05) / (one + 0.05) >= 4.5, (ink, ground)
