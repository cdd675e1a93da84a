"""The agreed state of a frame: columns over slots, keys and events, and the hashes of both."""

from dataclasses import dataclass, field

import numpy as np

from . import turn
from .errors import require
from .xxh3 import xxh3_64

BLOCK = 16384
MOST_P, MOST_V, MOST_C = 2**30, 2**28, 2**28
CODEC_COLUMNS = {"tracker": 5}  # of each group
PREDICTOR_COLUMNS = {"hard": 1, "rigid": 1}
KEYS, EVENTS, WORLD = 0x8C, 0x8D, 0x8E
FEATURES = {"keys": KEYS, "events": EVENTS}  # sections by feature


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


def read_keys(body):
    """Records of keys up to the end: {key: value, or None where it goes}."""
    changes, before = {}, b""
    while body.left():
        key = body.take(body.u8())
        require(1 <= len(key) <= 64 and all(0x20 <= byte <= 0x7E for byte in key), "keys", f"the key {key}")
        require(key > before, "keys", f"{key} behind {before}")
        before = key
        length = body.leb128(3)
        changes[key] = body.take(length - 1) if length else None
    return changes


def read_events(body, capacity):
    """Check a section of events: how many there are, and its bytes."""
    data, count = body.data, 0
    require(1 <= len(data) <= 16384, "events", f"a section of {len(data)} bytes")
    while body.left():
        require(body.leb128(5) < 2**32, "events", "a kind that is too large")
        slot = body.leb128(4)
        require(slot <= capacity, "events", f"slot {slot - 1}")
        if slot:
            body.u8()
        length = body.leb128(2)
        require(length <= 1024, "events", f"{length} bytes")
        body.take(length)
        count += 1
    require(count <= 64, "events", f"{count} of them")
    return count, data


@dataclass
class News:
    """What a session has beside bodies, after a frame."""

    features: tuple
    keys: dict = field(default_factory=dict)
    count: int = 0
    chain: int = 0  # N of the protocol

    def copy(self):
        """The same in memory of its own."""
        return News(self.features, dict(self.keys), self.count, self.chain)

    def change_keys(self, changes):
        """Apply what a frame, or a snapshot, tells of keys."""
        for key, value in changes.items():
            require(value is not None or key in self.keys, "keys", f"{key} goes, and is not there")
            self.keys[key] = value
        self.keys = {key: value for key, value in self.keys.items() if value is not None}
        size = sum(len(key) + len(value) for key, value in self.keys.items())
        require(len(self.keys) <= 256 and size <= 65536, "keys", f"{len(self.keys)} keys of {size} bytes")

    def add_events(self, count, data):
        """Count the events of a frame."""
        self.count += count
        self.chain = xxh3_64(self.chain.to_bytes(8, "little") + data)

    def hash(self):
        """The world hash."""
        keys = b"".join(
            bytes([len(key)]) + key + len(value).to_bytes(4, "little") + value for key, value in sorted(self.keys.items())
        )
        numbers = self.chain, self.count, xxh3_64(keys)
        return xxh3_64(b"".join(number.to_bytes(8, "little") for number in numbers))


def start_news(features):
    """The news of a session at its start; None without features."""
    return News(tuple(features)) if features else None


def read_world(body, features):
    """The section of a snapshot."""
    news = News(tuple(features), {}, body.u64(), body.u64())
    keys = read_keys(body)
    require("events" in features or not (news.count or news.chain), "world", "events of a session without them")
    require("keys" in features or not keys, "world", "keys of a session without them")
    news.change_keys(keys)
    return news
