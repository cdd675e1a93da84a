"""Writes the test vectors: python3 write_vectors.py FOLDER. What they are: idl/vectors/README.md."""

import math
import pathlib
import struct
import sys

import numpy as np
import worlds
import writer
from tandem_reference import payload, snapshot, turn, xxh3
from tandem_reference import tracker as reference_tracker
from tandem_reference.errors import Refused
from tandem_reference.huffman import Table
from tandem_reference.predict import Drive

NOTE = "# Written by tests/reference from PROTOCOL.md alone; tests/golden checks that ours agrees."
# Of the group orientation, which was written with the C++ in view.
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
        self.out.append("hash " + xxh3.text(self.line.world.state.hash()))

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


def absolute():
    """Codec none: three forms of selection."""
    vector = Vector("codec none: list, mask and all; c becomes 0", scattered("none", "ballistic", (0, 1, 5, 9), 10))
    vector.predict()
    vector.say("list: slot 5")
    vector.delta(writer.section(0x83, bytes.fromhex("00 00 0100 0500") + struct.pack("<6i", 1, -2, 2**30, 3, -4, 2**28)))
    vector.say("mask: slots 1 and 9")
    vector.delta(writer.section(0x83, bytes.fromhex("00 01 0202") + struct.pack("<12i", *range(-6, 6))))
    vector.say("all: slots 0, 1, 5, 9")
    vector.delta(writer.section(0x83, bytes.fromhex("00 02") + struct.pack("<24i", *range(100, 124))))
    vector.refuse(writer.section(0x83, bytes.fromhex("00 00 0100 0500") + struct.pack("<6i", 2**30 + 1, 0, 0, 0, 0, 0)),
                 "a position out of range")  # fmt: skip
    vector.refuse(writer.section(0x83, bytes.fromhex("00 01 0206") + bytes(72)), "an unused bit of the mask")
    vector.refuse(writer.section(0x83, bytes.fromhex("00 00 0000")), "nobody selected")
    vector.refuse(writer.section(0x83, bytes.fromhex("00 00 0100 0200") + bytes(24)), "a dead slot")
    return vector


def quantized():
    """Codec quantized, with the ends of the residuals and of the state."""
    line = scattered("quantized", "ballistic", (0, 3), 4)
    line.world.state.p[0, 0], line.world.state.v[0, 0] = -(2**30), 2**28
    line.world.state.c[:, 3], line.world.state.rest[3] = (5, 3000, -7), 1
    vector = Vector("codec quantized: residuals to -128 and 127, sums clamped, c stays, rest ends", line)
    vector.delta(writer.section(0x83, bytes.fromhex("00 02 8000 7f7f 0080 010203 ff8000")))
    vector.predict(2)
    return vector


def huffman():
    """Codec entropy, with another table for velocities than for positions."""
    tables = worlds.huffman_lengths() + bytes([8]) * 256
    vector = Vector("codec entropy", scattered("entropy", "ballistic", (0, 2, 3, 7), 8, tables))
    residuals = [[0, 0, -1, 0, 1, 255], [2, -2, 3, -128, 127, 0], [-128, 127, 4, 128, 5, 6]]
    codes = [Table(tables[:256]).code_of, Table(tables[256:]).code_of]
    packed = []
    for body in residuals:
        for i, value in enumerate(body):
            packed.append(codes[i // 3][value - 256 if value > 127 else value])
    data = bytes.fromhex("00 01 8c") + writer.joined_codes(packed)
    vector.predict()
    vector.say("slots 2, 3 and 7; the codes of all three follow each other without gaps")
    vector.delta(writer.section(0x83, data))
    vector.predict()
    vector.refuse(writer.section(0x83, data + b"\0"), "a byte behind the last code")
    vector.refuse(writer.section(0x83, data[:-1]), "a byte too few")
    vector.refuse(writer.section(0x83, data[:-1] + bytes([data[-1] | 1])), "a bit of the last byte that is not zero")
    return vector


def tracker(predictor, seed):
    """Several deltas in a row, so that the models learn; with renewed bodies and parameters that change."""
    slots = [slot for slot in range(30) if slot % 5 != 4]
    line = scattered("tracker", predictor, slots, 30, b"", seed)
    vector = Vector(f"codec tracker with {predictor}: twelve frames", line)
    following = worlds.random_numbers(seed + 1)
    place = writer.position((500, 600, 700), (9999, -9999, 0))
    born = writer.section(0x81, writer.record(3, 2, b"\1", place) + writer.record(1, 1, b"\1\1", place))
    for frame in range(1, 13):
        vector.predict()
        steps = some_steps(slots, following, (1, 2, 3) if frame < 9 else (20, 200, 3000))
        if frame == 4:
            vector.say("slot 3 teleported, not corrected; slot 4 spawned and corrected")
            vector.track({**{s: v for s, v in steps.items() if s != 3}, 4: [1, 0, -1]}, born, (3, 4))
        elif frame == 6:
            vector.say("nobody is corrected")
            vector.delta(b"")
        elif frame == 8:
            vector.say("threshold, decay and gains change; threshold and gains hold at once")
            vector.track(steps, writer.section(0x82, writer.parameters({1: 77, 4: 2000, 5: 30000, 6: 20000})))
        else:
            vector.track(steps)
    return vector


def some_steps(slots, following, sizes):
    """Steps, not all of them 0, of some of the slots."""
    steps = {slot: [following(size) for size in sizes] for slot in slots if following(100) > 20}
    return {slot: value for slot, value in steps.items() if any(value)}


def tracker_snapshot():
    """Ages, intervals, last steps and models of every kind, from a snapshot."""
    line = scattered("tracker", "contact", range(60), 60, b"", 8)
    following = worlds.random_numbers(9)
    state, models = line.world.state, line.world.models
    for slot in range(60):
        small = 40 if slot % 2 else 127
        state.codec[:, slot] = [following(small) % 255, following(small) % 256] + [following(3) for _ in range(3)]
        state.c[:, slot] = [following(9) for _ in range(3)]
        state.v[:, slot] = [following(300) for _ in range(3)]
    for model in range(len(models.p)):
        models.weight[model] = 128 + following(127)
        models.p[model] = 32768 + following(32000)
    start = writer.snapshot(line)
    vector = Vector("codec tracker: a start in the middle, with columns and models of every kind", line, start)
    for _ in range(3):
        vector.predict()
        vector.track(some_steps(range(60), following, (2, 30, 2)))
    vector.say("a snapshot of this frame holds the same state, parameters, drive and models")
    vector.snapshot(writer.snapshot(vector.line))
    return vector


def tracker_blocks():
    """Two blocks that share the models."""
    line = scattered("tracker", "ballistic", (0, 16383, 16384, 16389), 16390)
    vector = Vector("codec tracker: two blocks share the models, each has a code stream of its own", line)
    for steps in ({0: [1, 0, 0], 16389: [0, -2, 16]}, {16384: [0, 0, 1]}, {16383: [-1, -1, -1], 16384: [15, 0, 0]}):
        vector.predict()
        vector.track(steps)
    return vector


def tracker_rest():
    """Bodies put to rest, corrected where they rest, woken by gravity; one at rest from the start of a snapshot on."""
    slots = [slot for slot in range(20) if slot != 7]
    line = scattered("tracker", "ballistic", slots, 20, b"", 12)
    vector = Vector("codec tracker: bodies put to rest, and woken", line)
    following = worlds.random_numbers(13)
    for frame in range(1, 13):
        if frame == 7:
            vector.input(1, 8, Drive((40, -700, 3), 300))
        vector.predict()
        rests = [slot for slot in slots if following(100) > (20 if frame % 4 else -60)]
        if frame == 5:
            vector.say("slots 0 and 1 spawned and teleported where bodies rest; both are corrected, 0 is put to rest")
            place = writer.position((5, 6, 7), (640, -640, 0))
            born = writer.record(0, 0) + writer.record(0, 1, b"\1\1", place) + writer.record(1, 2, b"\1", place)
            vector.track({0: [1, 0, 0], 1: [0, 2, 0]}, writer.section(0x81, born), (0, 1), rests=(0,))
        else:
            vector.track(some_steps(slots, following, (2, 2, 3)), rests=rests)
    vector.say("a snapshot of this frame holds the same state")
    vector.snapshot(writer.snapshot(vector.line))
    return vector


def tracker_turns():
    """Corrections of both groups and of one, fine and not, rests, renewed bodies, a snapshot."""
    slots = [slot for slot in range(24) if slot % 6 != 5]
    line = scattered("tracker", "ballistic", slots, 24, b"", 31, turns=True)
    line.world.state.type[::3] = 1
    vector = Vector("codec tracker: orientations", line)
    following = worlds.random_numbers(32)

    def some_corrections(sizes):
        corrections = {}
        for slot in slots:
            rest = int(following(100) > 70)
            steps = [following(size) for size in sizes] if following(100) > -40 else None
            turn_by = [following(size) for size in sizes] if following(100) > -40 else None
            correction = tracker_of(rest, steps, turn_by, following(2) & 1)
            if correction:
                corrections[slot] = correction
        return corrections

    content = writer.position((500, 600, 700), (9999, -9999, 0)) + turned_content(following)
    for frame in range(1, 15):
        if frame == 9:
            vector.input(1, 10, Drive((40, -2800, 3), 300))
        vector.predict()
        if frame == 4:
            vector.say("slot 3 teleported, orientation alone, not corrected; slot 5 spawned and corrected")
            born = writer.section(
                0x81, writer.record(3, 2, b"\2", turned_content(following)) + writer.record(2, 1, b"\1\1", content)
            )
            corrections = {slot: how for slot, how in some_corrections((2, 2, 2)).items() if slot != 3}
            corrections[5] = reference_tracker.Correction(0, [1, 0, 0], [0, 1, -2], 1)
            vector.track(corrections, born, (3, 5))
        elif frame == 6:
            vector.say("nobody is corrected")
            vector.delta(b"")
        elif frame == 8:
            vector.say("p, v and c rounded; a new threshold")
            changed = writer.section(0x82, writer.parameters({1: 77}))
            vector.track(some_corrections((2, 3, 2)), changed, rounding=writer.section(0x87, bytes([2, 5, 3])))
        else:
            vector.track(some_corrections((1, 2, 3) if frame < 11 else (20, 200, 3000)))
    vector.say("a snapshot of this frame holds the same state")
    vector.snapshot(writer.snapshot(vector.line))
    return vector


def tracker_of(rest, steps, turn_by, fine):
    """A correction of the groups that have steps other than 0; None if none has."""
    steps = steps if steps and any(steps) else None
    turn_by = turn_by if turn_by and any(turn_by) else None
    if not steps and not turn_by:
        return None
    return reference_tracker.Correction(rest, steps, turn_by, fine if steps and turn_by else 0)


def turned_content(following):
    """What a record says of an orientation."""
    return struct.pack("<7i", *worlds.some_quaternion(following), *worlds.some_spin(following))


def tracker_refused():
    """Code streams that must be refused, for a body whose one correction is the byte 0e."""
    of = worlds.stream("tracker")
    vector = Vector("codec tracker: code streams that are refused", worlds.timeline(of, {0: ((0, 0, 0), (0, 0, 0))}))
    for why, data in (
        ("an empty code stream", "830100"),
        ("a zero at the end", "8303000e00"),
        ("a byte left over behind the last decision", "8307000e0000000001"),
        ("nobody is corrected", "83020010"),
        ("more than 2^31 - 1 steps", "8305000100000e"),
    ):
        vector.refuse(bytes.fromhex(data), why)
    vector.refuse(bytes.fromhex("86"), "an empty code stream without length and block")
    vector.refuse(bytes.fromhex("8302000e860e"), "the same block twice")
    vector.say("one step down z, and again as a section without length and block")
    vector.delta(bytes.fromhex("8302000e"))
    vector.track({0: [0, 0, -1]})
    return vector


def rounding():
    """Whole states that are rounded."""
    slots = [slot for slot in range(12) if slot != 4]
    line = scattered("tracker", "ballistic", slots, 12, b"", 8)
    state = line.world.state
    state.rest[:2], state.c[1, :2] = 1, 3000
    state.p[:, 11], state.v[:, 11] = (2**30, -(2**30), 2**30 - 1), (2**28, -(2**28), 1 - 2**28)
    vector = Vector("rounding, of bodies at rest (0 and 1) and at the limits (11) too", line)
    place = writer.position((555, -555, 555), (777, -777, 777))
    born = writer.section(0x81, writer.record(3, 2, b"\1", place) + writer.record(1, 1, b"\1\1", place))
    vector.predict()
    vector.say("nothing else")
    vector.delta(writer.section(0x87, bytes([2, 6, 3])))
    vector.predict()
    vector.say("by no bits, which changes nothing")
    vector.delta(writer.section(0x87, bytes(3)))
    vector.say("and corrections: 0 wakes")
    steps = {0: [1, 0, 0], 2: [0, 1, -1], 5: [1, 1, 1], 7: [-2, 300, 0], 11: [9, -9, 0]}
    vector.track(steps, rounding=writer.section(0x87, bytes([3, 7, 4])))
    vector.predict(2)
    vector.say("3 teleported, 4 spawned and corrected, a new threshold")
    changed = born + writer.section(0x82, writer.parameters({1: 4000}))
    vector.track({4: [1, 0, 0], 6: [0, 0, -3]}, changed, (3, 4), writer.section(0x87, bytes([7, 11, 8])))
    vector.predict(2)
    vector.say("by more than a step is worth")
    vector.track({8: [1, 0, 0], 9: [2, -1, 0]}, rounding=writer.section(0x87, bytes([24, 24, 24])))
    vector.predict()
    vector.refuse(writer.section(0x87, bytes([25, 0, 0])), "by too many bits")
    vector.refuse(writer.section(0x87, bytes([1, 1])), "too short")
    vector.refuse(writer.section(0x87, bytes(4)), "too long")
    vector.refuse(2 * writer.section(0x87, bytes(3)), "twice")
    vector.refuse(writer.section(0x87, bytes(3)) + writer.section(0x82, writer.parameters({1: 9})), "before parameters")
    vector.refuse(writer.section(0x83, b"\0\x0e") + writer.section(0x87, bytes(3)), "behind corrections")
    return vector


def lifecycle():
    """Records of every kind."""
    line = scattered("none", "ballistic", (0, 2, 5), 8)
    line.world.state.rest[[0, 2]] = 1
    line.world.state.c[:, 0] = line.world.state.c[:, 2] = 0, 3000, 0
    line.world.state.reuse[5] = 255
    vector = Vector("lifecycle records of every kind", line)
    place = writer.position((-1, 2, -3), (4, -5, 6))
    for why, records in (
        ("despawn of 2", [writer.record(2, 0)]),
        ("spawn in 2", [writer.record(2, 1, b"\1\1", place)]),
        ("teleport of 0, which wakes it", [writer.record(0, 2, b"\1", place)]),
        ("type change of 2", [writer.record(2, 3, b"\0")]),
        ("despawn and spawn of 5", [writer.record(5, 0), writer.record(0, 1, b"\0\1", place)]),
        ("several", [writer.record(0, 0), writer.record(1, 1, b"\1\0", place), writer.record(1, 3, b"\1")]),
    ):
        vector.say(why)
        vector.delta(writer.section(0x81, b"".join(records)))
    vector.predict()
    for why, records in (
        ("despawn of a dead slot", [writer.record(0, 0)]),
        ("spawn in a slot with a body", [writer.record(1, 1, b"\1\1", place)]),
        ("a slot beyond the capacity", [writer.record(8, 1, b"\1\1", place)]),
        ("a teleport of no group", [writer.record(1, 2, b"\0")]),
        ("a teleport of a group that is not listed", [writer.record(1, 2, b"\3", place)]),
        ("a type beyond the session's", [writer.record(1, 3, b"\2")]),
        ("two records of a slot", [writer.record(1, 3, b"\1"), writer.record(0, 2, b"\1", place)]),
        ("a spawn followed by a despawn", [writer.record(0, 1, b"\1\1", place), writer.record(0, 0)]),
        ("no record", []),
    ):
        vector.refuse(writer.section(0x81, b"".join(records)), why)
    return vector


def sections():
    """Parameters, unknown sections, order."""
    vector = Vector("parameters and unknown sections", scattered("quantized", "ballistic", (0, 1), 2))
    correct = writer.section(0x83, bytes.fromhex("00 02") + bytes([1, 2, 3, 4, 5, 6] * 2))
    vector.say("steps that change hold in the delta that carries them")
    vector.delta(writer.section(0x82, writer.parameters({2: 1000, 3: 70})) + correct)
    vector.say("the decay holds from the next step")
    vector.delta(writer.section(0x82, writer.parameters({4: 65535})))
    vector.predict()
    vector.say("one that names the value in force")
    vector.delta(writer.section(0x82, writer.parameters({4: 65535})))
    vector.say("unknown sections, before, between and behind")
    vector.delta(bytes.fromhex("0103aabbcc 8202 0400 7f00") + correct + bytes.fromhex("0200"))
    vector.say("corrections of the last block, without length and block")
    vector.delta(bytes.fromhex("86 02") + bytes([1, 2, 3, 4, 5, 6] * 2))
    vector.refuse(bytes.fromhex("86 02") + bytes([1, 2, 3, 4, 5, 6] * 2) + bytes.fromhex("0200"), "nothing may follow them")
    vector.refuse(bytes.fromhex("8400"), "an unknown critical section")
    vector.refuse(correct + bytes.fromhex("82020400"), "parameters behind corrections")
    vector.refuse(bytes.fromhex("8204 04000202"), "parameters that do not ascend")
    vector.refuse(bytes.fromhex("8202 0702"), "an unknown parameter")
    vector.refuse(bytes.fromhex("8202 0100"), "a threshold of 0")
    vector.refuse(bytes.fromhex("8203 048000"), "a value that is not in the shortest form")
    vector.refuse(bytes.fromhex("8203 0400"), "a section longer than the payload")
    return vector


def snapshots():
    """A snapshot with inputs to act, and snapshots that are refused."""
    line = scattered("none", "ballistic", [slot for slot in range(80) if slot % 11], 80, b"", 5)
    line.frame = 40
    line.world.state.reuse[1], line.world.state.type[2], line.world.state.rest[3] = 255, 1, 1
    line.world.state.c[1, 3] = 3000
    line.add_input(3, 42, Drive((1, 2, 3), 4))
    line.add_input(4, 43, Drive((5, 6, 7), 8))
    line.add_input(5, 42, Drive((9, -10, 11), 12))
    line.last_input = 6
    start = writer.snapshot(line)
    vector = Vector("a snapshot with inputs still to act; of two for a frame the highest number counts", line, start)
    vector.predict()
    vector.input(7, 44, Drive((0, 0, 0), 0))
    vector.predict(4)
    vector.refuse_snapshot(start[:4] + b"\2" + start[5:], "an unknown version")
    vector.refuse_snapshot(start[:59] + b"\1" + start[60:], "another capacity")
    vector.refuse_snapshot(start[:51] + bytes(8) + start[59:], "another state hash")
    vector.refuse_snapshot(start[:-1], "cut short")
    return vector


def ballistic_rest():
    """Rest with ballistic."""
    line = scattered("none", "ballistic", (0, 1, 2), 4)
    state = line.world.state
    state.rest[:2] = 1
    state.c[:, 0], state.c[:, 1], state.c[:, 2] = (0, 3000, 0), (0, 3000, 1), (0, 3000, 0)
    vector = Vector("ballistic: 0 rests, 1 wakes in the first step, 2 does not rest; a new gravity wakes 0", line)
    vector.predict(3)
    vector.input(1, 6, Drive((0, -2999, 0), 200))
    vector.predict(4)
    return vector


def turns():
    """Quaternions turned by angular velocities."""
    one, third = turn.ONE, 309959000  # a third of the limit's square
    limits = [[0, 0, 0], [1, -1, 1], [turn.MOST_W, 0, 0], [0, -turn.MOST_W, 0], [0, 0, turn.MOST_W - 1],
              [third, third, third], [-third, third, -third]]  # fmt: skip
    long, short = math.isqrt(2**58 + 2**48), math.isqrt(2**60 - 2**50) + 1
    plain = [[0, 0, 0, one], [0, 0, 0, -one], [one, 0, 0, 0], [0, -one, 0, 0], [one // 2] * 4,
             [long, -long, long, -long], [0, 0, short, 0], [0, -short, 0, 0]]  # fmt: skip
    following = worlds.random_numbers(31)
    cases = [(q, w) for q in plain for w in limits]
    cases += [(worlds.some_quaternion(following), w) for w in limits]
    cases += [(worlds.some_quaternion(following), worlds.some_spin(following)) for _ in range(60)]
    about = "# The turn: q x y z w, w x y z, then q afterwards; limits, norms just allowed, any, a chain"
    lines = [about, TURN_NOTE]
    for q, w in cases:
        lines.append(turn_line(q, w)[0])
    q, w = worlds.some_quaternion(following), [200000000, -100000000, 50000000]
    for _ in range(40):
        line, q = turn_line(q, w)
        lines.append(line)
    return "\n".join(lines) + "\n"


def turn_line(q, w):
    """A step `turn`, and the quaternion that it leads to."""
    of, by = np.array(q, np.int64).reshape(4, 1), np.array(w, np.int64).reshape(3, 1)
    assert turn.is_quaternion(of).all() and turn.is_spin(by).all(), (q, w)
    after = turn.turned(of, by)[:, 0].tolist()
    return "turn " + "  ".join(" ".join(str(x) for x in numbers) for numbers in (q, w, after)), after


def orientation():
    """Records of both groups."""
    line = scattered("none", "ballistic", (0, 1, 2, 5, 6), 8, b"", 21, True)
    state, one = line.world.state, turn.ONE
    state.rest[[0, 1]] = 1
    state.c[1, :2] = 3000
    state.v[:, :2] = 0
    state.w[:, 0] = 0
    vector = Vector("group orientation: records of every kind; 0 and 1 rest, 1 with an angular velocity", line)
    place = writer.position((-1, 2, -3), (4, -5, 6))
    q, w, most = worlds.some_quaternion(worlds.random_numbers(22)), (1000, -2**28, 77), turn.MOST_W
    turned = writer.orientation(q, w)
    edge = writer.orientation((0, one, 0, 0), (0, 0, -most))
    vector.predict(3)
    for why, records in (
        ("despawn of 2", [writer.record(2, 0)]),
        ("spawn in 2", [writer.record(2, 1, b"\1\1", place, turned)]),
        ("a teleport of the orientation of 0, which wakes it; c of 0 becomes 0", [writer.record(0, 2, b"\2", turned)]),
        ("of the position of 5", [writer.record(5, 2, b"\1", place)]),
        ("of both of 6, at the limit of w", [writer.record(6, 2, b"\3", place, edge)]),
        ("type change of 1, which wakes nobody", [writer.record(1, 3, b"\1")]),
        ("despawn and spawn of 5", [writer.record(5, 0), writer.record(0, 1, b"\0\1", place, edge)]),
    ):
        vector.say(why)
        vector.delta(writer.section(0x81, b"".join(records)))
        vector.predict()
    vector.say("p is rounded, q and w are not")
    vector.delta(writer.section(0x87, bytes([5, 5, 5])))
    vector.predict(10)
    vector.input(1, line.frame + 1, Drive((0, -2999, 5), 100))
    vector.say("gravity changes and wakes 1: it turns in the same step")
    vector.predict(3)

    def spawn(q, w):
        return [writer.record(3, 1, b"\1\1", place, writer.orientation(q, w))]

    half = one // 2
    for why, records in (
        ("a spawn without an orientation", [writer.record(3, 1, b"\1\1", place)]),
        ("a quaternion of zeros", spawn((0, 0, 0, 0), w)),
        ("too short a quaternion", spawn((half, half, half, half - 1100000), w)),
        ("too long a quaternion", spawn((half, half, half, half + 1100000), w)),
        ("a component beyond 1", spawn((0, 0, 0, one + 1), w)),
        ("a component far beyond 1", spawn((-(2**31), 0, 0, 0), w)),
        ("an axis of w beyond the limit", spawn(q, (most + 1, 0, 0))),
        ("w longer than the limit", spawn(q, (0, most, 1))),
        ("w far beyond the limit", spawn(q, (-(2**31), 0, 2**31 - 1))),
        ("a teleport of no group", [writer.record(1, 2, b"\0")]),
        ("a teleport of a group that is not listed", [writer.record(1, 2, b"\4", turned)]),
        ("of one beside those that are", [writer.record(1, 2, b"\7", place, turned)]),
        ("a teleport of the orientation of a dead slot", [writer.record(3, 2, b"\2", turned)]),
        ("one that is no quaternion", [writer.record(1, 2, b"\2", writer.orientation((0, 0, 0, half), w))]),
        ("one that ends too soon", [writer.record(1, 2, b"\2", turned[:-4])]),
        ("one with the position's content", [writer.record(1, 2, b"\2", place)]),
    ):
        vector.refuse(writer.section(0x81, b"".join(records)), why)
    return vector


def orientation_snapshot():
    """Orientations in a snapshot, and what none may hold."""
    slots = [slot for slot in range(40) if slot % 7]
    line = scattered("none", "ballistic", slots, 40, b"", 23, True)
    state = line.world.state
    state.rest[1], state.c[1, 1], state.w[:, 1] = 1, 3000, 0
    state.q[:, 2], state.w[:, 2] = (0, 0, 0, -turn.ONE), (0, turn.MOST_W, 0)
    start = writer.snapshot(line)
    broken = []
    for why, rows, values in (
        ("a quaternion of zeros", state.q, (0, 0, 0, 0)),
        ("too long a quaternion", state.q, (turn.ONE // 2, turn.ONE // 2, turn.ONE // 2, turn.ONE // 2 + 1100000)),
        ("a component beyond 1", state.q, (turn.ONE + 1, 0, 0, 0)),
        ("w longer than the limit", state.w, (turn.MOST_W, 0, -1)),
        ("an axis of w beyond the limit", state.w, (0, 0, -turn.MOST_W - 1)),
    ):
        before = rows[:, 3].copy()
        rows[:, 3] = values
        broken.append((writer.snapshot(line), why))
        rows[:, 3] = before
    vector = Vector("group orientation: a snapshot in mid-turn", line, start)
    vector.predict(5)
    for data, why in broken:
        vector.refuse_snapshot(data, why)
    vector.say("a snapshot of this frame holds the same state")
    vector.snapshot(writer.snapshot(vector.line))
    return vector


def orientation_steps(predictor):
    """Bodies that push each other and turn: one has nothing to do with the other."""
    line = scattered("none", predictor, range(12), 12, b"", 24, True)
    line.world.state.rest[3], line.world.state.c[1, 3] = 1, 3000
    vector = Vector(f"group orientation with {predictor}; 3 rests", line)
    vector.predict(10)
    return vector


def fifty_steps(predictor):
    """The world of 200 bodies among a plane, a box and a ball."""
    line = worlds.timeline(worlds.stream("none", predictor, 200, parameters={**worlds.PARAMETERS, 4: 800}))
    line.world.state = worlds.two_hundred_bodies()
    vector = Vector(f"{predictor}: 200 bodies of two types, a plane, a box, a ball; 50 steps", line)
    vector.predict(50)
    return vector


def contact_rest():
    """A body at rest among others, with contact."""
    of = worlds.stream("none", "contact")
    places = {i: ((i * 30000, 25000 + 4000 * i, 0), (0, -5000 * i, 0)) for i in range(4)}
    line = worlds.timeline(of, places)
    line.world.state.rest[1] = 1
    line.world.state.c[1, 1] = 3000
    line.world.state.v[0, 1] = 6400
    vector = Vector("contact: slot 1 rests (with a velocity, which the others feel); contact wakes nobody", line)
    vector.predict(5)
    return vector


def layout():
    """The layout hash of the specification's example."""
    values = {1: 100, 2: 1, 3: 1, 4: 0, 5: 26214, 6: 9830}
    of = type(worlds.stream())(10000, 2, "tracker", "ballistic", values, lattice_unit=2.0**-10, lead=1)
    lines = ["# The layout hash of the example in PROTOCOL.md", NOTE, "capacity 10000", "types 2",
             "lattice_unit 3f50000000000000", "lead 1", "codec tracker", "predictor ballistic",
             "parameters 1=100 2=1 3=1 4=0 5=26214 6=9830", f"layout_hash {xxh3.text(of.layout_hash())}",
             "hash " + xxh3.text(worlds.world(of).state.hash())]  # fmt: skip
    return "\n".join(lines) + "\n"


def main(folder):
    """Write all vectors."""
    vectors = {
        "absolute": absolute(),
        "quantized": quantized(),
        "huffman": huffman(),
        "tracker": tracker("ballistic", 3),
        "tracker_contact": tracker("contact", 4),
        "tracker_snapshot": tracker_snapshot(),
        "tracker_blocks": tracker_blocks(),
        "tracker_rest": tracker_rest(),
        "tracker_turns": tracker_turns(),
        "tracker_refused": tracker_refused(),
        "rounding": rounding(),
        "lifecycle": lifecycle(),
        "sections": sections(),
        "snapshot": snapshots(),
        "ballistic_rest": ballistic_rest(),
        "contact": fifty_steps("contact"),
        "contact_rest": contact_rest(),
        "field": fifty_steps("field"),
        "orientation": orientation(),
        "orientation_contact": orientation_steps("contact"),
        "orientation_field": orientation_steps("field"),
        "orientation_snapshot": orientation_snapshot(),
    }
    for name, vector in vectors.items():
        (pathlib.Path(folder) / f"{name}.txt").write_text(vector.text(), encoding="utf-8")
    (pathlib.Path(folder) / "layout.txt").write_text(layout(), encoding="utf-8")
    (pathlib.Path(folder) / "turn.txt").write_text(turns(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
