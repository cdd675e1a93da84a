"""Reader and checker of the test vectors in idl/vectors; their format: idl/vectors/README.md."""

import pathlib
import struct
from dataclasses import dataclass

import numpy as np

from . import parameters, payload, snapshot, turn
from .data import start_data
from .errors import Refused
from .snapshot import check_drive
from .state import State, start_news
from .stream import Stream
from .timeline import Timeline, compare_with_snapshot
from .xxh3 import text

HEADER = {
    "capacity", "types", "codec", "codec_tables", "predictor", "predictor_constants", "groups", "data", "radii", "features",
    "parameters", "lattice_unit", "lead", "layout_hash", "drive", "frame", "bodies",
}  # fmt: skip
STEPS = {"predict", "delta", "input", "snapshot", "turn", "hash", "refuse"}


class Wrong(Exception):
    """A vector that is badly written, or one that does not agree."""


@dataclass
class Line:
    """A key with all its values, and where it stands."""

    number: int
    key: str
    values: list

    def wrong(self, why):
        """An error that names the line."""
        return Wrong(f"line {self.number}: {self.key}: {why}")

    def integers(self, count=None):
        """The values as integers, as many as there must be."""
        try:
            numbers = [int(value) for value in self.values]
        except ValueError:
            raise self.wrong("not integers") from None
        if count is not None and len(numbers) != count:
            raise self.wrong(f"{len(numbers)} values instead of {count}")
        return numbers

    def word(self):
        """The one value."""
        if len(self.values) != 1:
            raise self.wrong("exactly one value was expected")
        return self.values[0]

    def hex(self):
        """The values as bytes."""
        try:
            return bytes.fromhex("".join(self.values))
        except ValueError:
            raise self.wrong("not hex digits") from None

    def hash(self):
        """The value as a hash of 16 hex digits."""
        if len(self.word()) != 16:
            raise self.wrong("not 16 hex digits")
        return int.from_bytes(self.hex(), "big")

    def double(self):
        """The value as the bit pattern of a double in 16 hex digits."""
        return struct.unpack(">d", self.hash().to_bytes(8, "big"))[0]


def read_lines(content):
    """Keys at the start of a line; indented lines carry on the values of the key before; # begins a comment."""
    lines = []
    for number, raw in enumerate(content.splitlines(), 1):
        words = raw.split("#")[0].split()
        if not words:
            continue
        if raw[0] in " \t":
            if not lines:
                raise Wrong(f"line {number}: values without a key")
            lines[-1].values += words
        else:
            lines.append(Line(number, words[0], words[1:]))
    for line in lines:
        if line.key not in HEADER | STEPS:
            raise line.wrong("unknown key")
    return lines


class Vector:
    """A vector: its stream, the state before, and the steps."""

    def __init__(self, content):
        lines = read_lines(content)
        begin = next((i for i, line in enumerate(lines) if line.key in STEPS), len(lines))
        self.header = {line.key: line for line in lines[:begin]}
        self.steps = lines[begin:]
        for line in self.steps:
            if line.key not in STEPS:
                raise line.wrong("stands behind the first step")
        if len(self.header) != begin:
            raise Wrong("a key of the header stands twice")

    def get(self, key, convert, otherwise=None):
        """A value of the header, converted; without a default it must be there."""
        if key in self.header:
            return convert(self.header[key])
        if otherwise is None:
            raise Wrong(f"{key} is missing")
        return otherwise

    def pairs(self, line):
        """The parameters as (id, value)."""
        try:
            return [tuple(int(number) for number in value.split("=")) for value in line.values]
        except ValueError:
            raise line.wrong("not id=value") from None

    def stream(self):
        """The stream that the header describes."""

        def one(line):
            return line.integers(1)[0]

        codec = self.get("codec", Line.word)
        groups = self.get("groups", lambda line: line.values, ["position"])
        predictor = self.get("predictor", Line.word)
        return Stream(
            capacity=self.get("capacity", one),
            types=self.get("types", one),
            codec=codec,
            predictor=predictor,
            parameters=parameters.complete(
                self.get("parameters", self.pairs), parameters.listed(codec, groups, predictor)
            ),
            codec_tables=self.get("codec_tables", Line.hex, b""),
            predictor_constants=self.get("predictor_constants", Line.integers, []),
            groups=groups,
            radii=self.get("radii", Line.integers, []),
            lattice_unit=self.get("lattice_unit", Line.double, 1.0),
            lead=self.get("lead", one, 0),
            features=self.get("features", lambda line: line.values, []),
            data=self.get("data", lambda line: [tuple(value.split(":")) for value in line.values], []),
        )

    def start(self, stream):
        """The timeline of the state in `bodies`."""
        state = State(stream.capacity, stream.codec, stream.orientation, stream.predictor)
        numbers = self.get("bodies", Line.integers, [])
        width = 20 if stream.orientation else 13
        if len(numbers) % width:
            raise self.header["bodies"].wrong(f"{width} numbers a body")
        for at in range(0, len(numbers), width):
            slot, reuse, kind, rest, *columns = numbers[at : at + width]
            if not 0 <= slot < stream.capacity or rest not in (0, 1):
                raise self.header["bodies"].wrong(f"slot {slot}, rest {rest}")
            state.alive[slot], state.rest[slot] = 1, rest
            state.reuse[slot], state.type[slot] = reuse, kind
            state.p[:, slot], state.v[:, slot], state.c[:, slot] = columns[:3], columns[3:6], columns[6:9]
            state.q[:, slot], state.w[:, slot] = columns[9:13], columns[13:]
        state.check_ranges(stream.types, "vector")
        *gravity, damping = self.get("drive", lambda line: line.integers(4), [0, 0, 0, 0])
        frame = self.get("frame", lambda line: line.integers(1)[0], 0)
        world = payload.World(
            state, dict(stream.parameters), payload.start_models(stream), start_news(stream.features),
            start_data(stream),
        )
        return Timeline(stream, world, frame, check_drive(gravity, damping, "vector"))

    def check(self):
        """Do all steps; how many outcomes agreed. Raises Wrong at the first that does not."""
        steps = list(self.steps)
        if not self.header and all(line.key == "turn" for line in steps):
            for line in steps:
                check_turn(line)
            return len(steps)
        try:
            stream = self.stream()
        except Refused as refusal:
            if len(steps) == 1 and steps[0].key == "refuse":
                check_refusal(steps[0], refusal)
                return 1
            raise Wrong(f"the stream is refused: {refusal}") from None
        self.check_layout(stream)
        first_is_snapshot = bool(steps) and steps[0].key == "snapshot"
        timeline = None if first_is_snapshot else self.start(stream)
        agreed, refusal = 0, None
        for line, following in zip(steps, [*steps[1:], None]):
            outcome = following.key if following else ""
            if line.key in ("predict", "delta", "snapshot") and outcome not in ("hash", "refuse"):
                raise line.wrong("must be followed by hash or refuse")
            if line.key == "refuse":
                check_refusal(line, refusal)
                agreed, refusal = agreed + 1, None
            elif line.key == "hash":
                check_hash(line, timeline)
                agreed += 1
            else:
                if line.key == "turn":
                    raise line.wrong("stands in a file of its own, without a header")
                timeline, refusal = do_step(line, stream, timeline)
                if refusal and outcome != "refuse":
                    raise line.wrong(f"refused ({refusal})")
        return agreed

    def check_layout(self, stream):
        """Compare the layout hash, where the vector tells it."""
        if "layout_hash" in self.header:
            line = self.header["layout_hash"]
            if line.hash() != stream.layout_hash():
                raise line.wrong(f"computed {text(stream.layout_hash())}")


def check_turn(line):
    """A quaternion turned by an angular velocity must be the one of the vector."""
    numbers = np.array(line.integers(11), np.int64)
    q, w, expected = numbers[:4], numbers[4:7], numbers[7:]
    if not (turn.is_quaternion(q) and turn.is_spin(w)):
        raise line.wrong("no quaternion or no angular velocity")
    computed = turn.turned(q.reshape(4, 1), w.reshape(3, 1))[:, 0]
    if (computed != expected).any():
        raise line.wrong(f"computed {computed.tolist()}")


def do_step(line, stream, timeline):
    """One step: (the timeline after it, the refusal or None). Refused bytes change nothing."""
    try:
        if line.key == "snapshot":
            cut = snapshot.read(line.hex(), stream)
            if timeline is None:
                return Timeline.of_snapshot(stream, cut), None
            if cut.frame != timeline.frame:
                raise line.wrong(f"of frame {cut.frame}, not {timeline.frame}")
            compare_with_snapshot(timeline, cut)
        elif timeline is None:
            raise line.wrong("no state yet")
        elif line.key == "predict":
            for _ in range(line.integers(1)[0] if line.values else 1):
                timeline.predict()
        elif line.key == "delta":
            timeline.apply(line.hex())
        elif line.key == "input":
            number, frame, *gravity, damping = line.integers(6)
            timeline.add_input(number, frame, check_drive(gravity, damping, "input"))
            timeline.last_input = number
    except Refused as refusal:
        return timeline, refusal
    return timeline, None


def check_refusal(line, refusal):
    """A refusal must be there, and by the rule that the vector names."""
    if not line.values:
        raise line.wrong("names no rule")
    if refusal is None:
        raise line.wrong("the bytes were accepted")
    if refusal.rule != line.values[0]:
        raise line.wrong(f"refused, but by another rule: {refusal}")


def check_hash(line, timeline):
    """The state hash must be the one of the vector."""
    if timeline is None:
        raise line.wrong("no state yet")
    computed = timeline.world.hash()
    if computed != line.hash():
        raise line.wrong(f"{line.word()} expected in frame {timeline.frame}, computed {text(computed)}")


def check_folder(folder, say):
    """Check all vectors of a folder; whether all agree."""
    files = sorted(pathlib.Path(folder).glob("*.txt"))
    good = bool(files)
    if not files:
        say(f"{folder}: no vectors (*.txt)")
    for file in files:
        try:
            agreed = Vector(file.read_text(encoding="utf-8")).check()
            say(f"{file.name}: {agreed} outcomes agree")
        except (Wrong, Refused) as error:
            say(f"{file.name}: {error}")
            good = False
    return good
