"""``registry/<protocol>.json``: the resolved registry, for tools that do not read our YAML."""

from stagewire_generator.targets.registry.view import registry_text, render

__all__ = ["registry_text", "render"]
