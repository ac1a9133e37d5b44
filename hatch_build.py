"""Compile the templates of the generator for a wheel or an editable installation."""

from __future__ import annotations

import runpy
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

TARGETS = "generator/stagewire_generator/targets"
IN_THE_WHEEL = "stagewire_generator/targets/compiled"


class CompiledTemplates(BuildHookInterface[Any]):
    """A build hook that adds the templates to a wheel as Python modules."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile the templates of the source tree."""
        ours = runpy.run_path(str(Path(self.root, TARGETS, "environment.py")))
        if version == "editable":
            ours["compile_templates"](ours["COMPILED"])
            return
        self.folder = tempfile.TemporaryDirectory()
        compiled = Path(self.folder.name, "compiled")
        ours["compile_templates"](compiled)
        build_data["force_include"][str(compiled)] = IN_THE_WHEEL

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the temporary modules."""
        if version != "editable":
            self.folder.cleanup()
