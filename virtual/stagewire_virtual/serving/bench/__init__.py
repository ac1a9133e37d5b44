"""A bench: virtual controllers that are served together, as a file or a command line describes them."""

from stagewire_virtual.serving.bench.bench import Bench, BenchUnit
from stagewire_virtual.serving.bench.reading import load_bench, make_bench

__all__ = ["Bench", "BenchUnit", "load_bench", "make_bench"]
