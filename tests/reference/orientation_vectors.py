"""The vectors of the group `orientation`, those of `tracker` excepted."""

import math
import struct

import numpy as np
import worlds
import writer
from tandem_reference import turn
from tandem_reference.huffman import Table
from tandem_reference.predict import Drive
from vector_text import TURN_NOTE, Vector, scattered


def vectors():
    """All of them by name."""
    return {
        "absolute_turns": absolute_turns(),
        "quantized_turns": quantized_turns(),
        "huffman_turns": huffman_turns(),
        "orientation": orientation(),
        "orientation_contact": orientation_steps("contact"),
        "orientation_field": orientation_steps("field"),
        "orientation_snapshot": orientation_snapshot(),
    }


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
    # Norms at the limits exactly; one that is long, about to lie along an axis.
    cases += [(q, w) for q in ((one, 2**25, 0, 0), (31 * 2**25, 7 * 2**25, 3 * 2**25, 2**26)) for w in limits[:2]]
    cases += [((0, 0, 514904931, 942527154), (0, 0, -(2**28)))]
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
    near = writer.orientation((0, one, 0, 0), (0, 600000, 1000 - most))
    vector.predict(3)
    for why, records in (
        ("despawn of 2", [writer.record(2, 0)]),
        ("spawn in 2", [writer.record(2, 1, b"\1\1", place, turned)]),
        ("a teleport of the orientation of 0, which wakes it; c of 0 becomes 0", [writer.record(0, 2, b"\2", turned)]),
        ("of the position of 5", [writer.record(5, 2, b"\1", place)]),
        ("of both of 6, near the limit of w", [writer.record(6, 2, b"\3", place, near)]),
        ("type change of 1, which wakes nobody", [writer.record(1, 3, b"\1")]),
        ("despawn and spawn of 5, at the limit of w", [writer.record(5, 0), writer.record(0, 1, b"\0\1", place, edge)]),
    ):
        vector.say(why)
        vector.delta(writer.section(0x81, b"".join(records)))
        vector.predict()
    vector.say("all is rounded; the w of 6 would leave its range and stays")
    vector.delta(writer.section(0x87, bytes([5, 5, 5, 12, 20])))
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
    state.q[:, 4] = [*[math.isqrt((2**60 + 2**50) // 3)] * 3, 0]  # x, y and z alone are too long for a w
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


def absolute_turns():
    """Codec none with orientations: what sets them and what is none."""
    line = scattered("none", "ballistic", (0, 1, 5, 9), 10, b"", 25, True)
    line.world.state.rest[1] = 1
    vector = Vector("codec none: orientations; 1 rests and is woken", line)
    following, one = worlds.random_numbers(26), turn.ONE

    def body(q, w, number=0):
        return struct.pack("<6i", *range(number, number + 6)) + writer.orientation(q, w)

    def any_body(number):
        return body(worlds.some_quaternion(following), worlds.some_spin(following), number)

    vector.predict()
    vector.say("list: slot 5, at the limit of w")
    vector.delta(writer.section(0x83, bytes.fromhex("00 00 0100 0500") + body((0, 0, -one, 0), (0, -turn.MOST_W, 0))))
    vector.say("mask: slots 1 and 9")
    vector.delta(writer.section(0x83, bytes.fromhex("00 01 0202") + any_body(-6) + any_body(2**20)))
    vector.predict(2)
    vector.say("all: slots 0, 1, 5, 9")
    vector.delta(writer.section(0x83, bytes.fromhex("00 02") + b"".join(any_body(100 * i) for i in range(4))))
    vector.predict()

    def of_one(content):
        return writer.section(0x83, bytes.fromhex("00 00 0100 0500") + content)

    unturned, still = (0, 0, 0, one), (0, 0, 0)
    for why, content in (
        ("a quaternion of zeros", body((0, 0, 0, 0), still)),
        ("too short a quaternion", body((one // 2, one // 2, one // 2, one // 2 - 1100000), still)),
        ("a component beyond 1", body((one + 1, 0, 0, 0), still)),
        ("a component far beyond 1", body((0, -(2**31), 0, 0), still)),
        ("an axis of w beyond the limit", body(unturned, (0, 0, -turn.MOST_W - 1))),
        ("w longer than the limit", body(unturned, (turn.MOST_W, 1, 0))),
        ("w far beyond the limit", body(unturned, (-(2**31), -(2**31), 2**31 - 1))),
        ("values without orientation", bytes(24)),
        ("a byte too few", body(unturned, still)[:-1]),
    ):
        vector.refuse(of_one(content), why)
    vector.refuse(writer.section(0x82, writer.parameters({7: 5})), "the turn step, which this stream does not have")
    return vector


def quantized_turns():
    """Codec quantized with orientations, to the ends of residuals, steps and w."""
    line = scattered("quantized", "ballistic", (0, 2, 3), 4, b"", 27, True)
    state = line.world.state
    state.q[:, 0], state.w[:, 0] = (0, 0, 0, turn.ONE), (turn.MOST_W, 0, 0)
    state.c[:, 3], state.rest[3] = (5, 3000, -7), 1
    vector = Vector("codec quantized: orientations", line)
    vector.say("residuals to -128 and 127; 3 rested")
    vector.delta(writer.section(0x83, bytes.fromhex(
        "00 02  000000 000000 7f0080 000000  010203 040506 070809 0a0bf4  ff8000 7f7f7f 80807f ff01ff")))  # fmt: skip
    vector.predict(2)
    vector.say("steps as large as they may be: what leads beyond the limit of w is halved until it is within")
    wide = writer.section(0x82, writer.parameters({7: 2**24, 8: 2**24}))
    vector.delta(wide + writer.section(0x83, bytes.fromhex(
        "00 02  000000 000000 808080 7f7f7f  000000 000000 7f0000 800000  000000 000000 000000 00807f")))  # fmt: skip
    vector.predict(2)
    vector.say("steps of turns hold in the delta that carries them, and afterwards")
    small = writer.section(0x82, writer.parameters({1: 99, 7: 1000, 8: 1}))
    vector.delta(small + writer.section(0x83, bytes.fromhex("00 01 04 010101 010101 050607 08090a")))
    vector.predict()
    vector.say("as the last block, without length and block")
    vector.delta(bytes.fromhex("86 01 01 010101 010101 050607 08090a"))
    vector.say("a snapshot of this frame names the steps of turns")
    vector.snapshot(writer.snapshot(vector.line))
    for why, data in (
        ("six residuals a body", writer.section(0x83, bytes.fromhex("00 01 04 010101 010101"))),
        ("a turn step of 0", writer.section(0x82, writer.parameters({7: 0}))),
        ("a turn step beyond the limit", writer.section(0x82, writer.parameters({7: 2**24 + 1}))),
        ("parameters that do not ascend", writer.section(0x82, writer.parameters({8: 1, 7: 1}))),
        ("an unknown parameter", writer.section(0x82, writer.parameters({9: 1}))),
    ):
        vector.refuse(data, why)
    spin_step = line.world.parameters.pop(8)
    without = writer.snapshot(line)
    line.world.parameters[8] = spin_step
    vector.refuse_snapshot(without, "a snapshot without the spin step")
    return vector


def huffman_turns():
    """Codec limited with orientations: a table for each vector of residuals."""
    flat, steep = bytes([8]) * 256, worlds.huffman_lengths()
    tables = steep + flat + steep[::-1] + steep
    vector = Vector("codec limited: orientations", scattered("limited", "ballistic", (0, 2, 3, 7), 8, tables, 28, True))
    residuals = [
        [0, 0, -1, 0, 1, -1, 2, 0, -1, 5, 0, 0],
        [2, -2, 3, -128, 127, 0, -128, 127, -3, 0, 1, -1],
        [-128, 127, 4, -128, 5, 6, 0, 0, 0, -128, 127, 9],
    ]
    codes = [Table(tables[at : at + 256]).code_of for at in range(0, 1024, 256)]
    packed = [codes[i // 3][value] for body in residuals for i, value in enumerate(body)]
    data = bytes.fromhex("00 01 8c") + writer.joined_codes(packed)
    vector.predict()
    vector.say("slots 2, 3 and 7; the codes of all three follow each other without gaps")
    vector.delta(writer.section(0x83, data))
    vector.predict(3)
    vector.refuse(writer.section(0x83, data + b"\0"), "a byte behind the last code")
    vector.refuse(writer.section(0x83, data[:-1]), "a byte too few")
    vector.say("all, and other steps")
    packed = [codes[i // 3][(3 * i + body) % 5 - 2] for body in range(4) for i in range(12)]
    changed = writer.section(0x82, writer.parameters({2: 50, 3: 60, 7: 70000, 8: 80000}))
    vector.delta(changed + writer.section(0x83, bytes.fromhex("00 02") + writer.joined_codes(packed)))
    vector.predict(2)
    return vector
