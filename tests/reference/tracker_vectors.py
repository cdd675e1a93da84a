"""The vectors of the codec `tracker`, and of rounding."""

import math
from dataclasses import replace

import worlds
import writer
from tandem_reference import turn
from tandem_reference.predict import Drive
from tandem_reference.tracker import Correction
from vector_text import Vector, scattered


def vectors():
    """All of them by name."""
    return {
        "tracker": deltas("ballistic", 3),
        "tracker_contact": deltas("contact", 4),
        "tracker_snapshot": middle(),
        "tracker_blocks": blocks(),
        "tracker_rest": rests(),
        "tracker_turns": turns(),
        "tracker_turns_refused": refused_of_turns(),
        "tracker_turns_snapshot": middle_of_turns(),
        "tracker_turns_rounded": rounded_turns(),
        "tracker_field": field(),
        "tracker_refused": refused(),
        "rounding": rounding(),
    }


def deltas(predictor, seed):
    """Several deltas in a row, so that the models learn; with renewed bodies and parameters that change."""
    slots = [slot for slot in range(30) if slot % 5 != 4]
    line = scattered("tracker", predictor, slots, 30, b"", seed)
    vector = Vector(f"codec tracker with {predictor}: eighteen frames", line)
    following = worlds.random_numbers(seed + 1)
    changes = {
        8: ({1: 77, 4: 2000, 5: 30000, 6: 20000}, "threshold, decay and gains change; threshold and gains hold at once"),
        14: ({1: 300001, 5: 65535, 6: 65535}, "a large threshold, the largest gains"),
        16: ({1: 5}, "a small threshold: gravity limits c, also along axes that are not corrected"),
        18: ({1: 1}, "the smallest threshold"),
    }
    place = writer.position((500, 600, 700), (9999, -9999, 0))
    born = writer.section(0x81, writer.record(3, 2, b"\1", place) + writer.record(1, 1, b"\1\1", place))
    sizes = {**dict.fromkeys(range(9, 13), (20, 200, 3000)), 15: (2, 2, 2), 16: (2, 60, 2), 17: (900, 2, 900)}
    for frame in range(1, 19):
        if frame == 15:
            vector.input(1, 16, Drive((4000, -3000, 100), 100))
        vector.predict()
        steps = some_steps(slots, following, sizes.get(frame, (1, 2, 3)))
        if frame == 4:
            vector.say("slot 3 teleported, not corrected; slot 4 spawned and corrected")
            vector.track({**{s: v for s, v in steps.items() if s != 3}, 4: [1, 0, -1]}, born, (3, 4))
        elif frame == 6:
            vector.say("nobody is corrected")
            vector.delta(b"")
        elif frame == 10:
            vector.say("slot 8 teleported; nobody is corrected")
            vector.delta(writer.section(0x81, writer.record(8, 2, b"\1", place)))
        elif frame == 13:
            vector.say("slot 2 of another type, which renews nobody")
            vector.track(steps, writer.section(0x81, writer.record(2, 3, b"\1")))
        elif frame in changes:
            vector.say(changes[frame][1])
            vector.track(steps, writer.section(0x82, writer.parameters(changes[frame][0])))
        else:
            vector.track(steps)
    return vector


def some_steps(slots, following, sizes):
    """Steps, not all of them 0, of some of the slots."""
    steps = {slot: [following(size) for size in sizes] for slot in slots if following(100) > 20}
    return {slot: value for slot, value in steps.items() if any(value)}


def learn_anything(models, following):
    """Weights and probabilities of every kind; some that one decision leads beyond the limits."""
    for model in range(len(models.p)):
        models.weight[model] = min(max(128 + following(160), 0), 255)
        if models.weight[model]:
            models.p[model] = 32768 + following(32000)
        if following(100) > 70:
            models.weight[model], models.p[model] = (1, 255, 6)[model % 3], 32 if model % 2 else 65504


# Where classes of frames begin.
EDGES = 0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 15, 16, 19, 20, 23, 24, 39, 40, 63, 64, 127, 128, 249, 250, 253, 254


def some_columns(slot, following):
    """Columns of a group: age, interval and last steps; ages and intervals about where a class begins."""
    age = EDGES[slot % len(EDGES)]
    interval = (*EDGES, 255)[following(14) + 14] if slot % 4 else 0
    return [age, interval, *([following(3) for _ in range(3)] if slot % 7 else (127, -127, following(127)))]


def middle():
    """Ages, intervals, last steps and models of every kind, from a snapshot."""
    line = scattered("tracker", "contact", range(60), 60, b"", 8)
    following = worlds.random_numbers(9)
    state = line.world.state
    # With this threshold its quarter and its 32nd part are rounded.
    threshold = line.world.parameters[1] = 119
    of_v = threshold + threshold // 4, 20 * threshold, 64 * threshold
    for slot in range(60):
        state.codec[:, slot] = some_columns(slot, following)
        state.c[:, slot] = [following(9) for _ in range(3)]
        state.v[:, slot] = [following(300) for _ in range(3)]
        if slot % 3 == 0:
            state.v[slot // 3 % 3, slot] = (1, -1)[slot % 2] * (of_v[slot // 6 % 3] + slot // 18 % 2)
            state.c[:, slot] = [(1, -1)[following(2)] * (threshold // 32 + abs(following(2)) % 2) for _ in range(3)]
    learn_anything(line.world.models, following)
    start = writer.snapshot(line)
    vector = Vector("codec tracker: a start in the middle, with columns and models of every kind", line, start)
    vector.track(some_steps(range(0, 60, 2), following, (2, 2, 2)))
    for _ in range(3):
        vector.predict()
        vector.track(some_steps(range(60), following, (2, 30, 2)))
    vector.say("as many steps as there may be")
    vector.predict()
    vector.track({3: [2**31 - 1, 1, 1 - 2**31], 4: [0, -(2**30) - 64, 2**30 + 63]})
    vector.say("a snapshot of this frame holds the same state, parameters, drive and models")
    vector.snapshot(writer.snapshot(vector.line))
    return vector


def middle_of_turns():
    """The same of a stream of orientations, which plays on; a type of the largest radius."""
    line = scattered("tracker", "ballistic", range(54), 54, b"", 41, turns=True)
    line.stream = replace(line.stream, radii=[500, 2**30])
    following = worlds.random_numbers(42)
    state = line.world.state
    state.type[::4] = 1
    for slot in range(54):
        state.codec[:5, slot] = some_columns(slot, following)
        state.codec[5:, slot] = some_columns(slot + following(3), following)
        state.w[:, slot] = [(2**17, 2**18)[following(2)] * following(3) + following(2) for _ in range(3)]
        state.v[:, slot] = [following(300) for _ in range(3)]
        state.c[:, slot] = [following(9) for _ in range(3)]
    state.rest[5::9] = 1
    state.c[:, 5::9] = [[0], [3000], [0]]
    state.w[:, 5::9] = 0
    state.w[:, 2] = turn.MOST_W, 0, 0
    learn_anything(line.world.models, following)
    about = "codec tracker: orientations from the middle, with columns and models of every kind"
    vector = Vector(about, line, writer.snapshot(line))
    vector.track(some_corrections(range(0, 54, 2), following, (2, 2, 2)))
    changes = {
        2: ({1: 3000001, 5: 65535}, "a large threshold, the largest gain: angles, turns and growth at their limits"),
        4: ({1: 70}, "a small one again"),
        5: ({1: 1}, "the smallest: angles of bodies of type 1 are 1"),
    }
    content = turned_content(following)
    place = writer.position((1, 2, 3), (4, 5, 6))
    born = [writer.record(7, 2, b"\2", content), writer.record(1, 3, b"\0"), writer.record(1, 2, b"\1", place)]
    for frame in range(1, 8):
        vector.predict()
        corrections = some_corrections(range(54), following, (2, 2, 3))
        if frame in changes:
            vector.say(changes[frame][1])
            if frame == 2:
                corrections |= turns_of_2_rad()
            vector.track(corrections, writer.section(0x82, writer.parameters(changes[frame][0])))
        elif frame == 3:
            vector.say("slot 7 turned, 9 moved, 8 of another type, all corrected")
            corrections[7] = Correction(0, None, [-1, 1, 2], 0)
            corrections[8] = Correction(0, [1, 1, 0], [1, 0, -1], 1)
            corrections[9] = Correction(0, [1, 0, 0], [2, -2, 1], 0)
            vector.track(corrections, writer.section(0x81, b"".join(born)), (7, 9))
        elif frame == 6:
            vector.say("slot 3 turned; nobody is corrected")
            vector.delta(writer.section(0x81, writer.record(3, 2, b"\2", content)))
        else:
            vector.track(corrections)
    return vector


def turns_of_2_rad():
    """Steps of 2 rad: at the limit of one turn (the first, which has the maximum w), and beyond it, also by the length alone."""
    steps = [1, 0, 0], [0, -1, 0], [1, 1, 0], [2, 0, 0], [-1, 0, -1], [0, 3, 0], [1, -1, 1], [-5, 1, 0]
    return {slot: Correction(0, None, turn_by) for slot, turn_by in zip((2, 6, 10, 11, 15, 18, 19, 22), steps)}


def rounded_turns():
    """Roundings of orientations, of bodies at rest next to each other too, and snapshots before and after."""
    slots = [slot for slot in range(28) if slot != 7]
    line = scattered("tracker", "ballistic", slots, 28, b"", 51, turns=True)
    following = worlds.random_numbers(52)
    state = line.world.state
    resting = [*range(8, 13), *range(15, 22)]
    state.rest[resting] = 1
    state.v[:, resting], state.c[:, resting] = 0, [[0], [3000], [0]]
    state.w[:, [slot for slot in resting if slot % 3]] = 0
    for slot in resting:
        # Neighbours lie alike; every other one has the other sign.
        alike = state.q[:, slot - slot % 5 if slot < 15 else 15] + [following(2**12) for _ in range(4)]
        state.q[:, slot] = alike * (-1) ** (slot // 2)
    one, long = turn.ONE, math.isqrt(2**58 + 2**48)
    for slot, q in enumerate(([long, -long, long, -long], [0, -one, 0, -100], [one, 0, 0, 100], [-one, 0, 0, 0],
                              [0, 0, 0, -one], [long, long, -long, long])):  # fmt: skip
        state.q[:, slot] = q
    for slot, w in ((1, (-(2**29), 0, 0)), (24, (2**29 - 1, 30000, 0)), (25, (-2, 30000, 5 - 2**29)), (26, (2**29 - 1, 12345, 0)), (4, (0, 2**29, 0)),
                    (5, (3, -3, 2**20 + 1)), (6, (2**23, -(2**23), 3 * 2**23))):  # fmt: skip
        state.w[:, slot] = w
    for slot in slots:
        for group in (0, 5):
            age = (5, 5, 0, 0, 5, 9, 0, 9, 9)[(slot + group) % 9]
            interval = (255, 0, 255, 3, 3, 0, 200)[(slot + group) % 7]
            state.codec[group : group + 5, slot] = [age, interval, *([1, 1, -1] if slot % 3 else [0, 1, -1])]
    about = "codec tracker: rounded orientations; bodies at rest that lie alike, some of which turn; 0 and 5 as long as q may be"
    vector = Vector(about, line, writer.snapshot(line))
    vector.say("halves; 9 and 16 are woken, 17 is turned where it rests, 23 put to rest")
    corrections = {
        2: Correction(0, [1, 0, 0], [0, 1, -1], 0), 3: Correction(0, None, [1, -1, 0]), 9: Correction(0, [0, 1, 0]),
        16: Correction(0, None, [1, 2, -3]), 17: Correction(1, None, [0, 0, 1]), 23: Correction(1, [1, 1, 1], [2, 0, 0], 1),
    }  # fmt: skip
    vector.track(corrections, rounding=writer.section(0x87, bytes([1, 1, 1, 1, 1])))
    vector.say("q rounded by no bits, so that its sign stays")
    vector.delta(writer.section(0x87, bytes([0, 0, 0, 0, 15])))
    vector.say("0 and 5, turned, would leave their range and stay, but for the sign; w of 1 is rounded to 0; 6, 13, 14, turned, are corrected")
    places = {0: (long, -long, long, -long), 1: (0, -one, 0, -100), 5: (long, long, -long, long)}
    places |= {slot: worlds.some_quaternion(following) for slot in (6, 13, 14)}
    born = [writer.record(gap, 2, b"\2", writer.orientation(q, (5, -6, 7))) for gap, q in zip((0, 1, 4, 1, 7, 1), places.values())]
    turned = {slot: Correction(0, None, [9, -4, slot]) for slot in (6, 13, 14)}
    vector.track(turned, writer.section(0x81, b"".join(born)), places, rounding=writer.section(0x87, bytes([0, 0, 0, 18, 0])))
    vector.predict()
    vector.say("all, by the maximum")
    vector.track(corrections, rounding=writer.section(0x87, bytes([4, 5, 6, 18, 24])))
    vector.predict()
    vector.say("4 and 5 leave; q rounded, corrected and rounded again; a snapshot of this frame has short columns")
    gone = writer.section(0x81, writer.record(4, 0) + writer.record(1, 0))
    corrections = {slot: how for slot, how in corrections.items() if slot > 9}
    vector.track(corrections, gone, rounding=writer.section(0x87, bytes([4, 5, 6, 17, 20])))
    vector.snapshot(writer.snapshot(vector.line))
    vector.say("the same with other numbers of ones")
    for more in (-3, 1, 40000):
        vector.snapshot(writer.snapshot(vector.line, more_ones=more))
    return vector


def field():
    """`field` with several sub-steps a frame, which mean what they mean for `contact`; gains too."""
    line = scattered("tracker", "field", range(12), 12, b"", 61)
    line.stream = worlds.stream("tracker", "field", 12, constants=worlds.CONTACT)
    vector = Vector("codec tracker with field of two sub-steps a frame", line)
    following = worlds.random_numbers(62)
    for _ in range(4):
        vector.predict()
        vector.track(some_steps(range(12), following, (1, 2, 3)))
    return vector


def refused_of_turns():
    """Snapshots that no stream of orientations has."""
    line = scattered("tracker", "ballistic", range(2), 2, b"", 43, turns=True)
    vector = Vector("codec tracker: snapshots of orientations that are refused", line)
    columns = line.world.state.codec
    for group, column, value, why in (
        (0, 0, 255, "an age of 255"),
        (1, 0, 255, "an age of 255 of the orientation"),
        (0, 2, -128, "a last step of -128"),
        (1, 4, -128, "a last step of -128 of the orientation"),
    ):
        columns[5 * group + column, 1] = value
        vector.refuse_snapshot(writer.snapshot(line), why)
        columns[5 * group + column, 1] = 0
    return vector


def blocks():
    """Two blocks that share the models."""
    line = scattered("tracker", "ballistic", (0, 16383, 16384, 16389), 16390)
    vector = Vector("codec tracker: two blocks share the models, each has a code stream of its own", line)
    for steps in ({0: [1, 0, 0], 16389: [0, -2, 16]}, {16384: [0, 0, 1]}, {16383: [-1, -1, -1], 16384: [15, 0, 0]}):
        vector.predict()
        vector.track(steps)
    vector.say("a snapshot of this frame: a block without a section taught nothing")
    vector.snapshot(writer.snapshot(vector.line))
    return vector


def rests():
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


def turns():
    """Corrections of both groups and of one, fine and not, rests, renewed bodies, a snapshot."""
    slots = [slot for slot in range(24) if slot % 6 != 5]
    line = scattered("tracker", "ballistic", slots, 24, b"", 31, turns=True)
    line.world.state.type[::3] = 1
    vector = Vector("codec tracker: orientations", line)
    following = worlds.random_numbers(32)

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
            corrections = {slot: how for slot, how in some_corrections(slots, following, (2, 2, 2)).items() if slot != 3}
            corrections[5] = Correction(0, [1, 0, 0], [0, 1, -2], 1)
            vector.track(corrections, born, (3, 5))
        elif frame == 6:
            vector.say("nobody is corrected")
            vector.delta(b"")
        elif frame == 8:
            vector.say("all rounded; a new threshold")
            changed = writer.section(0x82, writer.parameters({1: 77}))
            vector.track(some_corrections(slots, following, (2, 3, 2)), changed, rounding=writer.section(0x87, bytes([2, 5, 3, 18, 16])))
        elif frame == 12:
            vector.say("q and w rounded alone")
            vector.delta(writer.section(0x87, bytes([0, 0, 0, 15, 20])))
        else:
            vector.track(some_corrections(slots, following, (1, 2, 3) if frame < 11 else (20, 200, 3000)))
    vector.say("a snapshot of this frame holds the same state")
    vector.snapshot(writer.snapshot(vector.line))
    vector.predict()
    for bits, why in (((25, 0, 0, 0, 0), "p by too many bits"), ((0, 0, 0, 19, 0), "q by too many bits"),
                      ((0, 0, 0, 0, 25), "w by too many bits"), ((1, 1, 1), "without q and w")):  # fmt: skip
        vector.refuse(writer.section(0x87, bytes(bits)), why)
    return vector


def some_corrections(slots, following, sizes):
    """Corrections of some of the slots, of either group or both."""
    corrections = {}
    for slot in slots:
        rest = int(following(100) > 70)
        steps = [following(size) for size in sizes] if following(100) > -40 else None
        turn_by = [following(size) for size in sizes] if following(100) > -40 else None
        correction = correction_of(rest, steps, turn_by, following(2) & 1)
        if correction:
            corrections[slot] = correction
    return corrections


def correction_of(rest, steps, turn_by, fine):
    """A correction of the groups that have steps other than 0; None if none has."""
    steps = steps if steps and any(steps) else None
    turn_by = turn_by if turn_by and any(turn_by) else None
    if not steps and not turn_by:
        return None
    return Correction(rest, steps, turn_by, fine if steps and turn_by else 0)


def turned_content(following):
    """Return the bytes of a record's orientation."""
    return writer.orientation(worlds.some_quaternion(following), worlds.some_spin(following))


def refused():
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
