"""Captures as columns: one array for every field instead of one object for every frame.

:func:`columns` reads frames of one layout that stand back to back, with the standard library alone;
:func:`numpy_columns` does the same with NumPy (``pip install 'stagewire[numpy]'``). A stream of all kinds
of frames is sorted first: :func:`gather` cuts it, with the rule of :mod:`stagewire.framing`, and keeps the
frames of every layout apart.

    >>> from stagewire.columns import gather
    >>> from stagewire_apt import PROTOCOL, messages as m
    >>> gathered = gather(PROTOCOL, [bytes.fromhex("91040e008150 0100 10270000 0000 0000 10000080")])
    >>> gathered.frames[m.MotGetDcStatusUpdate].columns()["position"]
    array('i', [10000])

The columns are ``dest`` and ``source`` (addresses, without the bit that announces a packet), then the fields
in wire order, reserved ones included. Integers are raw, in the narrowest array that holds the field. Nothing
is checked against the ranges of the registry: what was received is kept, as in decoding.
"""

from __future__ import annotations

from stagewire._lazy import lazy

TYPE_CHECKING = False
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

if not TYPE_CHECKING:  # else any name would be taken for one of these
    __getattr__ = lazy(
        __name__,
        {
            "_columns.shape": "Field Field=Place Kind Shape shape_of",
            "_columns.arrays": "Column columns numpy_columns",
            "_columns.streams": "Frames Gatherer Sorter gather",
        },
    )
