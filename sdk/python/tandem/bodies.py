"""Arrays of bodies, as in samples and recordings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Optional

import numpy as np

#: Name, type and numbers of a body, in the order of tandem_columns.
COLUMNS: dict[str, tuple[Any, int]] = {
    "positions": (np.float32, 3),
    "velocities": (np.float32, 3),
    "orientations": (np.float32, 4),
    "angular_velocities": (np.float32, 3),
    "types": (np.uint16, 1),
    "alive": (np.bool_, 1),
    "reuse": (np.uint8, 1),
    "changes": (np.uint8, 1),
}

#: Kinds of fields of data of bodies, in the order of their numbers.
DATA_KINDS = ("u1", "i1", "<u2", "<i2", "<u4", "<i4", "<f4", "(4,)u1")


def data_type(fields: Iterable[tuple[str, int]]) -> np.dtype:
    """The type of a record, from the names and kinds of its fields."""
    return np.dtype([(name, DATA_KINDS[kind]) for name, kind in fields])


class Bodies:
    """Arrays with a row for each slot of a session. Those that are not wanted are None.

    The arrays are of the object's own, and then replaced when a session has another number of slots; or the
    caller's (`into`), which are written to where they are, as far as the session has slots.
    """

    COLUMNS: tuple[str, ...] = tuple(COLUMNS)

    positions: Optional[np.ndarray]  #: (n, 3) float32: x, y, z; scene units
    velocities: Optional[np.ndarray]  #: (n, 3) float32; scene units / s: how fast `positions` move
    angular_velocities: Optional[np.ndarray]  #: (n, 3) float32, in the world's frame; rad / s
    types: Optional[np.ndarray]  #: (n,) uint16: an index into types()
    alive: Optional[np.ndarray]  #: (n,) bool: the slot holds a body. Where not, the others say nothing
    reuse: Optional[np.ndarray]  #: (n,) uint8: counts the bodies that a slot has held; wraps

    def __init__(self, columns: Optional[Iterable[str]] = None) -> None:
        """`columns`: the names of the arrays that are wanted; None: all."""
        wanted = self.COLUMNS if columns is None else tuple(columns)
        unknown = set(wanted) - set(self.COLUMNS)
        if unknown:
            raise ValueError(f"no such column: {', '.join(sorted(unknown))}; there are {', '.join(self.COLUMNS)}")
        self._wanted = wanted
        self._own = True
        self.capacity = 0  #: slots of the session: rows that count
        self.epoch = 0  #: of the server's run
        self.has_orientations = False  #: the session has them. If not, its bodies are points
        self._place({name: _empty(name, 0) for name in wanted})

    @classmethod
    def into(cls, arrays: "np.ndarray | Mapping[str, np.ndarray]") -> "Bodies":
        """Bodies in the caller's arrays: the fields of a structured array, or a mapping, by the columns' names.

        Fields of other names are left alone. The numbers of a body lie side by side, bodies at any stride.
        """
        if not isinstance(arrays, (np.ndarray, Mapping)):
            raise TypeError(f"needs a structured array or a mapping of arrays, not {type(arrays).__name__}")
        names = arrays.dtype.names or () if isinstance(arrays, np.ndarray) else arrays.keys()
        wanted = [name for name in cls.COLUMNS if name in names]
        if not wanted:
            raise ValueError(f"none of its fields is one of {', '.join(cls.COLUMNS)}")
        bodies = cls(wanted)
        bodies._own = False
        bodies._place({name: arrays[name] for name in wanted})
        return bodies

    @property
    def orientations(self) -> Optional[np.ndarray]:
        """(n, 4) float32: quaternions x, y, z, w of norm 1, from the body's frame to the world's. None where the
        session has none."""
        return self._arrays["orientations"] if self.has_orientations and "orientations" in self._arrays else None

    def _place(self, arrays: dict[str, np.ndarray]) -> None:
        self._arrays = arrays
        self._columns = tuple(arrays.get(name) for name in COLUMNS)
        for name in self.COLUMNS:
            if name != "orientations":
                setattr(self, name, arrays.get(name))

    def _fit(self, capacity: int) -> bool:
        """Makes arrays of its own as long as a session's. True: they are new ones, with nothing in them yet."""
        rows = min((len(array) for array in self._arrays.values()), default=capacity)
        if not self._own or rows == capacity:
            return False
        if rows > capacity:
            self._place({name: array[:capacity] for name, array in self._arrays.items()})
            return False
        self._place({name: _empty(name, capacity) for name in self._wanted})
        return True


def _empty(name: str, capacity: int) -> np.ndarray:
    kind, numbers = COLUMNS[name]
    return np.zeros(capacity if numbers == 1 else (capacity, numbers), kind)
