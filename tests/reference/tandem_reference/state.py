"""The agreed state of a frame: columns over slots, and its hash."""

import numpy as np

from . import turn
from .errors import require
from .xxh3 import xxh3_64

BLOCK = 16384
MOST_P, MOST_V, MOST_C = 2**30, 2**28, 2**28
CODEC_COLUMNS = {"tracker": 5}  # of each group
PREDICTOR_COLUMNS = {"hard": 1, "rigid": 1}


class State:
    """Columns as arrays over the slots; p, v, c, q, w, the codec's and the predictor's have one row an axis or column.

    Without the group `orientation` q and w have no rows.
    """

    def __init__(self, capacity, codec, orientation=False, predictor=""):
        self.capacity = capacity
        self.orientation = orientation
        self.alive = np.zeros(capacity, bool)
        self.reuse = np.zeros(capacity, np.int64)
        self.type = np.zeros(capacity, np.int64)
        self.rest = np.zeros(capacity, bool)
        self.p = np.zeros((3, capacity), np.int64)
        self.v = np.zeros((3, capacity), np.int64)
        self.c = np.zeros((3, capacity), np.int64)
        self.q = np.zeros((4 * orientation, capacity), np.int64)
        self.w = np.zeros((3 * orientation, capacity), np.int64)
        self.codec = np.zeros((CODEC_COLUMNS.get(codec, 0) * (1 + orientation), capacity), np.int64)
        self.own = np.zeros((PREDICTOR_COLUMNS.get(predictor, 0), capacity), np.int64)

    def copy(self):
        """The same state in arrays of its own."""
        twin = object.__new__(State)
        twin.capacity, twin.orientation = self.capacity, self.orientation
        for name in ("alive", "reuse", "type", "rest", "p", "v", "c", "q", "w", "codec", "own"):
            setattr(twin, name, getattr(self, name).copy())
        return twin

    def clear(self, slot):
        """Despawn: set every column of the slot to zero."""
        for column in (self.alive, self.reuse, self.type, self.rest):
            column[slot] = 0
        for rows in (self.p, self.v, self.c, self.q, self.w, self.codec, self.own):
            rows[:, slot] = 0

    def blocks(self):
        """How many blocks there are."""
        return -(-self.capacity // BLOCK)

    def block_slots(self, block):
        """First slot of a block, and the one behind its last."""
        return block * BLOCK, min((block + 1) * BLOCK, self.capacity)

    def leaves(self, block):
        """Return the hashes of a block: leaf 0 with the columns outside of groups, then one of each group."""
        first, end = self.block_slots(block)
        common = [
            self.alive[first:end].astype("u1"),
            self.reuse[first:end].astype("u1"),
            self.type[first:end].astype("<u2"),
            self.rest[first:end].astype("u1"),
            *(row[first:end].astype("u1") for row in self.codec),
            *(row[first:end].astype("u1") for row in self.own),
        ]
        groups = [(self.p, self.v, self.c)] + [(self.q, self.w)] * self.orientation
        of_groups = [[row[first:end].astype("<i4") for rows in group for row in rows] for group in groups]
        return [xxh3_64(b"".join(column.tobytes() for column in columns)) for columns in (common, *of_groups)]

    def leaves_hash(self):
        """The hash of the leaves of all blocks."""
        leaves = [leaf for block in range(self.blocks()) for leaf in self.leaves(block)]
        return xxh3_64(b"".join(leaf.to_bytes(8, "little") for leaf in leaves))

    def hash(self):
        """The state hash: of the hash of all leaves."""
        return xxh3_64(self.leaves_hash().to_bytes(8, "little"))

    def check_ranges(self, types, rule):
        """Refuse a state with a value that no state may hold."""
        require(not np.any(self.type >= types), rule, "a type that the session does not have")
        for rows, most, name in ((self.p, MOST_P, "p"), (self.v, MOST_V, "v"), (self.c, MOST_C, "c")):
            require(not np.any(np.abs(rows) > most), rule, f"{name} out of range")
        if self.orientation:
            living = self.alive.astype(bool)
            require(turn.is_quaternion(self.q[:, living]).all(), rule, "a quaternion that is none")
            require(turn.is_spin(self.w[:, living]).all(), rule, "w out of range")
