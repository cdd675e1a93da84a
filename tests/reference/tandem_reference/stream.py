"""The fixed part of a stream: capacity, types, codec, predictor; and the hash of its layout."""

import struct
from dataclasses import dataclass, field

from . import contact, huffman, parameters, rigid, xxh3
from .data import KINDS, check_fields
from .errors import require
from .state import FEATURES

CODECS = ("none", "selective", "quantized", "entropy", "limited", "tracker")
PREDICTORS = ("ballistic", "contact", "field", "hard", "rigid")
MOST_SLOTS = {"hard": 2**18, "rigid": 2**14}
WORK = {"contact": (32, 1, 4), "field": (32, 1, 4), "hard": (64, 1, 4), "rigid": (1200, 16, 32)}  # body, plane, solid
MOST_WORK = 60_000_000
GROUPS = ["position"], ["position", "orientation"]
MOST_RADIUS = 2**30
VERSION = 4


@dataclass
class Stream:
    """The parameters of a stream, checked; `parameters` are those of frame 0, by id."""

    capacity: int
    types: int
    codec: str
    predictor: str
    parameters: dict
    codec_tables: bytes = b""
    predictor_constants: list = field(default_factory=list)
    groups: list = field(default_factory=lambda: ["position"])
    radii: list = field(default_factory=list)
    lattice_unit: float = 1.0
    lead: int = 0
    features: list = field(default_factory=list)
    data: list = field(default_factory=list)  # (name, kind) of the session's fields, if the groups list `data`

    def __post_init__(self):
        known = all(feature in FEATURES for feature in self.features)
        require(known and self.features == sorted(set(self.features)), "session", f"features {self.features}")
        require(1 <= self.capacity <= 2**22, "session", f"capacity {self.capacity}")
        require(1 <= self.types <= 65535, "session", f"{self.types} types")
        check_fields(self.data)
        of_motion = self.groups[:-1] if self.data and self.groups[-1:] == ["data"] else self.groups
        require(of_motion in GROUPS, "session", f"groups {self.groups}")
        require(not self.data or of_motion != self.groups, "session", "fields of data without the group")
        require(self.codec in CODECS, "session", f"unknown codec {self.codec}")
        require(self.predictor in PREDICTORS, "session", f"unknown predictor {self.predictor}")
        few = self.capacity <= MOST_SLOTS.get(self.predictor, 2**22)
        require(few, "session", f"capacity {self.capacity} with the predictor {self.predictor}")
        self.orientation = "orientation" in self.groups
        require(self.orientation or self.predictor != "rigid", "session", "rigid without orientations")
        needed = self.types if self.orientation else 0
        require(len(self.radii) == needed, "session", f"{len(self.radii)} radii where the groups need {needed}")
        require(all(1 <= radius <= MOST_RADIUS for radius in self.radii), "session", f"radii {self.radii}")
        known = parameters.listed(self.codec, self.groups, self.predictor)
        self.parameters = parameters.complete(list(self.parameters.items()), known)
        if self.codec in ("entropy", "limited"):
            self.tables = huffman.tables(self.codec_tables, 2 + 2 * self.orientation)
        else:
            require(self.codec_tables == b"", "session", f"codec {self.codec} has no tables")
        if self.predictor == "ballistic":
            require(not self.predictor_constants, "session", "ballistic has no constants")
        else:
            self.world = (rigid if self.predictor == "rigid" else contact).read_world(self.predictor_constants)
            require(self.work_of_step() <= MOST_WORK, "session", f"a step of {self.predictor} takes too long")

    def work_of_step(self):
        """See "Work of a step"."""
        body, plane, solid = WORK[self.predictor]
        planes, boxes, balls = self.predictor_constants[8:11]
        times = self.predictor_constants[0] if self.predictor in ("contact", "field") else 1
        return self.capacity * times * (body + plane * planes + solid * (boxes + balls))

    def layout_text(self):
        """The text whose hash is the layout hash."""
        unit = struct.pack(">d", self.lattice_unit).hex()

        def line(word, values):
            return " ".join([word, *(str(value) for value in values)])

        lines = [
            line("tandem-layout", [VERSION]),
            line("capacity", [self.capacity]),
            line("types", [self.types]),
            line("lattice_unit", [unit]),
            line("lead", [self.lead]),
            *([line("features", self.features)] if self.features else []),
            *([line("data", [f"{name}:{kind}" for name, kind in self.data])] if self.data else []),
            line("groups", self.groups),
            line("radii", self.radii),
            line("codec", [self.codec]),
            line("codec_tables", [xxh3.text(xxh3.xxh3_64(self.codec_tables))]),
            line("predictor", [self.predictor]),
            line("predictor_constants", self.predictor_constants),
            line("parameters", [f"{identity}={value}" for identity, value in self.parameters.items()]),
        ]
        return "".join(one + "\n" for one in lines)

    def layout_hash(self):
        """Return the layout hash that the session must announce."""
        return xxh3.xxh3_64(self.layout_text().encode())


def fields_of(session):
    """The fields of data that a TandemSession lists, as (name, kind)."""
    require(all(one.kind < len(KINDS) for one in session.data), "session", "a field of data of an unknown kind")
    return [(one.name, list(KINDS)[one.kind]) for one in session.data]


def of_session(session, announced):
    """The stream that a TandemSession announces; refused where it cannot be played."""
    require(session.protocol_version == VERSION, "session", f"protocol version {session.protocol_version}")
    stream = Stream(
        capacity=session.capacity,
        types=len(session.types),
        codec=announced.codec,
        predictor=announced.predictor,
        parameters=parameters.complete(
            [(entry.id, entry.value) for entry in announced.parameters],
            parameters.listed(announced.codec, announced.groups, announced.predictor),
        ),
        codec_tables=announced.codec_tables,
        predictor_constants=announced.predictor_constants,
        groups=announced.groups,
        radii=announced.radii,
        lattice_unit=session.lattice_unit,
        lead=session.lead,
        features=session.features,
        data=fields_of(session) if "data" in announced.groups else [],
    )
    computed = stream.layout_hash()
    require(
        computed == announced.layout_hash,
        "session",
        f"layout hash {xxh3.text(announced.layout_hash)}, but its text hashes to {xxh3.text(computed)}",
    )
    return stream
