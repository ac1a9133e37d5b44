"""Captures as columns: one array per field instead of one object per frame.

:func:`columns` reads back-to-back frames of one layout and needs only the standard library.
:func:`numpy_columns` does the same with NumPy (``pip install 'stagewire[numpy]'``). Sort a stream of mixed
frames first: :func:`gather` cuts it into frames as :mod:`stagewire.framing` does and groups them by layout.

    >>> from stagewire.columns import gather
    >>> from stagewire_apt import PROTOCOL, messages as m
    >>> gathered = gather(PROTOCOL, [bytes.fromhex("91040e008150 0100 10270000 0000 0000 10000080")])
    >>> gathered.frames[m.MotGetDcStatusUpdate].columns()["position"]
    array('i', [10000])

The columns are ``dest`` and ``source`` (addresses, without the bit that announces a packet), then the fields
in wire order, including reserved ones. Integers are raw, in the narrowest array that holds the field. Values
are not checked against the ranges of the registry: as in decoding, they are kept as received.
"""

from __future__ import annotations

from stagewire._lazy import lazy

TYPE_CHECKING: bool = False
if TYPE_CHECKING:
    from stagewire._columns.arrays import Column, columns, numpy_columns
    from stagewire._columns.shape import Field, Kind, Shape, shape_of
    from stagewire._columns.streams import Frames, Gatherer, Sorter, gather

    Place = Field  # the name of 0.1

__all__ = [
    "Column",
    "Field",
    "Frames",
    "Gatherer",
    "Kind",
    "Shape",
    "Sorter",
    "columns",
    "gather",
    "numpy_columns",
    "shape_of",
]

__path__: list[str] = []  # modules of 0.1 below this name; see stagewire._deprecated

if not TYPE_CHECKING:  # otherwise type checkers would accept any name
    __getattr__, __dir__ = lazy(
        __name__,
        {
            "_columns.shape": "Field Field=Place Kind Shape shape_of",
            "_columns.arrays": "Column columns numpy_columns",
            "_columns.streams": "Frames Gatherer Sorter gather",
        },
    )
