"""The text of a test vector: what it is written by. The format: idl/vectors/README.md."""

import numpy as np
import worlds
import writer
from tandem_reference import payload, snapshot, xxh3
from tandem_reference.errors import Refused

NOTE = "# Written by tests/reference from PROTOCOL.md alone; tests/golden checks that ours agrees."
# Texts of the group orientation, whose decoder was written with the C++ in view.
TURN_NOTE = "# Written by tests/reference; tests/golden checks that ours agrees."


def hex_lines(data):
    """Bytes as indented lines of 32."""
    return [f"    {data[i : i + 32].hex()}" for i in range(0, len(data), 32)]


class Vector:
    """The text of a vector, and the timeline that it leads along."""

    def __init__(self, about, line, start=None):
        self.line = line
        of = line.stream
        note = TURN_NOTE if of.orientation else NOTE
        self.out = [f"# {about}", note, f"capacity {of.capacity}", f"types {of.types}", f"codec {of.codec}"]
        if of.codec_tables:
            self.out += ["codec_tables", *hex_lines(of.codec_tables)]
        self.out.append(f"predictor {of.predictor}")
        if of.predictor_constants:
            self.out.append("predictor_constants " + " ".join(str(value) for value in of.predictor_constants))
        self.out.append("groups " + " ".join(of.groups))
        if of.data:
            self.out.append("data " + " ".join(f"{name}:{kind}" for name, kind in of.data))
        if of.features:
            self.out.append("features " + " ".join(of.features))
        if of.radii:
            self.out.append("radii " + " ".join(str(radius) for radius in of.radii))
        self.out.append("parameters " + " ".join(f"{i}={value}" for i, value in of.parameters.items()))
        if start is None:
            self.bodies()
            self.hash()
        else:
            self.snapshot(start)

    def bodies(self):
        """Drive, frame and state before the first step."""
        drive, state = self.line.drive, self.line.world.state
        self.out.append("drive " + " ".join(str(value) for value in (*drive.gravity, drive.damping)))
        names = "slot reuse type rest  p x y z  v x y z  c x y z"
        groups = [state.p, state.v, state.c]
        if state.orientation:
            names += "  q x y z w  w x y z"
            groups += [state.q, state.w]
        self.out += [f"frame {self.line.frame}", f"bodies  # {names}"]
        for slot in np.flatnonzero(state.alive):
            numbers = [slot, state.reuse[slot], state.type[slot], int(state.rest[slot])]
            columns = "  ".join(" ".join(str(x) for x in rows[:, slot]) for rows in groups)
            self.out.append("    " + " ".join(str(x) for x in numbers) + "  " + columns)

    def say(self, text):
        """A comment before the next step."""
        self.out += ["", f"# {text}"]

    def hash(self):
        """The hash of the present state."""
        self.out.append("hash " + xxh3.text(self.line.world.hash()))

    def predict(self, steps=1):
        """A predicted step, or several."""
        for _ in range(steps):
            self.line.predict()
            self.out.append(f"predict  # frame {self.line.frame}")
            self.hash()

    def delta(self, data):
        """A delta that is accepted."""
        self.line.apply(data)
        self.out += ["delta", *hex_lines(data)]
        self.hash()

    def track(self, steps, before=b"", renewed=(), rounding=b"", rests=()):
        """A delta of tracker corrections, behind other sections; contexts know nothing of a rounding."""
        between = payload.apply_delta(self.line.world, self.line.stream, before)
        between.models = self.line.world.models
        between.state.codec[:] = self.line.world.state.codec
        between.state.codec[:, list(renewed)] = 0
        flags = np.isin(np.arange(between.state.capacity), list(renewed))
        data = before + rounding
        for block in range(between.state.blocks()):
            first, end = between.state.block_slots(block)
            here = {slot: value for slot, value in steps.items() if first <= slot < end}
            if here:
                data += writer.tracker_section(between, between.parameters[1], here, flags, block, rests)
        self.delta(data)

    def refuse(self, data, why):
        """A delta that is refused."""
        try:
            payload.apply_delta(self.line.world, self.line.stream, data)
        except Refused as refusal:
            self.say(why)
            self.out += ["delta", *hex_lines(data), f"refuse {refusal.rule}"]
            return
        raise AssertionError(f"accepted: {why}")

    def snapshot(self, data):
        """A snapshot: the start, or one that must hold the present state."""
        snapshot.read(data, self.line.stream)
        self.out += ["snapshot", *hex_lines(data)]
        self.hash()

    def refuse_snapshot(self, data, why):
        """A snapshot that is refused."""
        try:
            snapshot.read(data, self.line.stream)
        except Refused as refusal:
            self.say(why)
            self.out += ["snapshot", *hex_lines(data), f"refuse {refusal.rule}"]
            return
        raise AssertionError(f"accepted: {why}")

    def input(self, number, frame, drive):
        """A scheduled input."""
        self.line.add_input(number, frame, drive)
        self.line.last_input = number
        self.out.append(f"input {number} {frame} " + " ".join(str(x) for x in (*drive.gravity, drive.damping)))

    def text(self):
        """The whole file."""
        return "\n".join(self.out) + "\n"


def scattered(codec, predictor, slots, capacity, tables=b"", seed=1, turns=False):
    """A timeline of bodies at seeded places, turned and turning if it says so."""
    of = worlds.stream(codec, predictor, capacity, tables=tables, turns=turns)
    following = worlds.random_numbers(seed)
    places = {s: ([following(9000) for _ in range(3)], [following(900) for _ in range(3)]) for s in slots}
    line = worlds.timeline(of, places)
    for slot in slots if turns else ():
        line.world.state.q[:, slot] = worlds.some_quaternion(following)
        line.world.state.w[:, slot] = worlds.some_spin(following)
    return line
