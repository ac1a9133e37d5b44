"""The user documentation, and the test that runs each code block, here or in another folder.

A block without a row fails a test, and so does a row without a block.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from checkout import ROOT
from markdown_blocks import Block, blocks

ELSEWHERE = {
    "docs/how-to/build-systems.md": "tests/packaging/build_systems/test_build_systems_page.py",
    "docs/reference/c.md": "tests/generated/c/test_c_page.py",
    "docs/contributing.md": "tests/documentation/walkthrough/test_contributing.py",
    "docs/how-to/add-a-framing.md": "tests/documentation/walkthrough/test_contributing.py",
    "docs/how-to/overlays.md#Add a unit and its stage": (
        "tests/documentation/walkthrough/test_contributing.py"
    ),
    "docs/how-to/correct-a-fact.md": "tests/documentation/walkthrough/test_contributing.py",
    "docs/tutorials/new-message.md": "tests/documentation/walkthrough/test_contributing.py",
    "docs/control-systems.md#Over EPICS": "tests/control/test_epics_plans.py",
    "docs/how-to/epics.md": "tests/control/test_epics_page.py",
    "docs/reference/vectors.md": "tests/conformance/testees/test_cases.py",
    "docs/tutorials/your-own-protocol.md": "tests/documentation/walkthrough/test_your_own_protocol.py",
    "examples/c/README.md": "tests/generated/c/test_c_examples.py",
}
"""Documents, or sections (``DOCUMENT#SECTION``), whose blocks are all checked by other tests, which do more
than run them.
"""

NOT_RUN = {
    "python3 -m venv .venv/stage": "slow; tests/packaging/test_distribution.py creates an environment",
    ". .venv/stage/bin/activate": "follows the line above",
    "pip install .": "needs the network; tests/packaging/test_distribution.py installs the wheel",
    "pip install '.[generator]'": "needs the network",
    "pip install '.[numpy,parquet]'": "needs the network",
    "pip install '.[plot]'": "needs the network",
    "pip install '.[pandas,pint]'": "needs the network",
    "pip install '.[panel]'": "needs the network",
    "pip install '.[conformance]'": "needs the network",
    "pip install '.[bluesky]'": "needs the network",
    "pip install '.[epics]'": "needs the network",
    "pip install '.[pymmcore]'": "needs the network",
    "pip install '.[bluesky,plot]'": "needs the network",
    'stagewire panel "virtual://TDC001?stage=Z8" "virtual://KDC101?stage=PRM1-Z8"'
    " --stage Z8 --stage PRM1-Z8": (
        "needs a terminal; tests/cli/test_cli_panel_terminal.py has one"
    ),
    'stagewire panel "virtual://TDC001?stage=Z8" --stage Z8 --travel 12': "needs a terminal",
    "stagewire panel /dev/ttyUSB0 --unit BBD102 --stage MLS203": "needs a controller",
    "stagewire panel COM3 COM4 --stage Z825B --travel 25": "needs controllers",
    "stagewire conformance device socket://127.0.0.1:4001 --pics pics.toml --html report.html": (
        "takes a minute; benchmarks/conformance_time.py has complete runs, and the next lines partial ones"
    ),
    "stagewire conformance device /dev/ttyUSB0 --pics pics.toml --allow-settings --allow-tuning"
    " --allow-motion 0..5mm --allow-eeprom --html report.html": "needs a controller",
    "stagewire conformance compare old.json new.json": (
        "needs two reports; tests/cli/test_cli_conformance_compare.py makes some"
    ),
    "stagewire conformance pics --from /dev/ttyUSB0 --out pics.toml": "needs a controller",
    "stagewire conformance device /dev/ttyUSB0 --pics pics.toml --html report.html": "needs a controller",
    "stagewire generate --spec-dir . --package acme_turntable --out build/acme": (
        "needs the reader's spec; tests/documentation/walkthrough/test_your_own_protocol.py has one"
    ),
    "pip install build/acme/python": "needs the same spec",
    "stagewire show SET_ANGLE": "needs the same spec",
    "python benchmarks/framing_experiment.py --table small --runs 60": "very slow; make bench runs it",
    "python benchmarks/framing_experiment.py --table generated --runs 20": "very slow; make bench runs it",
    "python tests/mutation/mutants.py": "very slow; tests/mutation/test_mutants.py runs a part",
    "python tests/mutation/facts_at_errata.py": (
        "slow; tests/mutation/test_facts_at_errata.py runs a part"
    ),
    "python tools/compare_document": (
        "needs the vendor's document; tests/spec/document/test_issue_37.py runs its checks"
    ),
    "python tests/mutation/leaves.py --seed 3": "very slow; tests/mutation/test_leaves.py runs a part",
    "python tests/mutation/entries.py --number 500": "slow; tests/mutation/test_entries.py runs a part",
}
"""Lines of shell blocks that are not run, each with the reason."""

LONG = {
    "stagewire format": "8 s",
    "stagewire format --check spec": "8 s",
    "stagewire format spec": "8 s",
}
"""Lines that only `make test-all` runs, each with its processor time."""

BY_MACHINE = {
    "stagewire doctor": "exits with 1 on a machine without a controller",
}
"""Lines whose exit status may be 1, each with the reason."""

READ_ONLY = {
    (
        "docs/architecture.md",
        "stagewire_cli -> stagewire_epics, stagewire_conformance, stagewire_generator, stagewire_virtual, "
        "stagewire_apt, stagewire",
    ): "a diagram; tests/structure compares it with the imports",
    ("docs/how-to/editors.md", "spec/"): "a tree of folders",
    ("docs/how-to/overlays.md", "spec/thorlabs_apt/overlays/later_issues/"): "a tree of folders",
    (
        "docs/how-to/virtual.md",
        "to_host|to_controller ACTION [byte|frame] [KEY=VALUE ...]",
    ): "a grammar",
    ("docs/how-to/editors.md", 'vim.lsp.config("yamlls", {'): "settings of Neovim",
    ("docs/how-to/editors.md", "(add-hook 'yaml-ts-mode-hook #'eglot-ensure)"): "settings of Emacs",
}
"""Blocks that cannot be run, by document and first line, each with its content."""


def documents() -> list[str]:
    """Return every user document as a path from the top of the project."""
    found = [ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/**/*.md")]
    return sorted(path.relative_to(ROOT).as_posix() for path in found)


def is_elsewhere(document: str, block: Block) -> bool:
    """Whether a test in another folder checks a block."""
    return not ELSEWHERE.keys().isdisjoint({document, f"{document}#{block.section}"})


def here(*languages: str) -> Iterator[tuple[str, Block]]:
    """Yield each block that the tests of this folder run, with its document."""
    for document in documents():
        for block in blocks(Path(ROOT, document)):
            if block.language not in languages or is_elsewhere(document, block):
                continue
            if (document, block.first) not in READ_ONLY:
                yield document, block
