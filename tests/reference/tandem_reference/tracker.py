"""The codec `tracker`: models, contexts, and the filter that corrects a body."""

from dataclasses import dataclass

import numpy as np

from . import parameters, turn
from .errors import require
from .integers import clamp
from .range_decoder import CountingDecoder, NumberModels
from .state import MOST_C, MOST_P, MOST_V

FLAG, FLAG_AT_REST, REST, ZERO, SIGN, SIZE, PLACE, ESCAPE = 0, 675, 690, 720, 1080, 1404, 1944, 1952
STEP_MODELS = 1264
OF_POSITIONS = ZERO + STEP_MODELS
BOTH, WHICH, FINE, TURN = OF_POSITIONS, OF_POSITIONS + 75, OF_POSITIONS + 150, OF_POSITIONS + 151
AGE, INTERVAL, LAST = 0, 1, slice(2, 5)
GROUP = 5  # columns
SLOW_TURN, FAST_TURN = 2**18, 2**22
# The least size of each class, and of what escapes.
CLASSES = 1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65
LONG_STEPS = 3
MOST_STEPS = 2**31 - 1


class Models:
    """Probability of a 1 (in 1/65536) and weight of every model, in the order of the specification."""

    def __init__(self, orientation=False):
        self.p = np.full(TURN + STEP_MODELS if orientation else OF_POSITIONS, 32768, np.int64)
        self.p[FLAG:ZERO] = 4096
        self.weight = np.zeros_like(self.p)

    def copy(self):
        """The same models in arrays of their own."""
        twin = object.__new__(Models)
        twin.p, twin.weight = self.p.copy(), self.weight.copy()
        return twin

    def learn(self, zeros, ones):
        """Learn from the decisions of a delta: how many of each model were 0 and 1."""
        made = zeros + ones > 0
        seen = self.weight + 1 + zeros + ones
        learnt = np.clip(((self.weight + 1) * self.p + 65536 * ones) // seen, 32, 65504)
        self.p = np.where(made, learnt, self.p)
        self.weight = np.where(made, np.minimum(255, self.weight + zeros + ones), self.weight)

    def read(self, numbers):
        """Take the models of a snapshot."""
        weights, ones, rest = NumberModels(), [NumberModels() for _ in range(8)], NumberModels()
        for model in range(len(self.p)):
            lacks = numbers.number(weights)
            require(0 <= lacks <= 255, "snapshot", f"a model that lacks {lacks} of its weight")
            weight = -lacks % 256
            self.weight[model] = weight
            if weight:
                seen = numbers.number(ones[weight.bit_length() - 1])
                guess = (int(self.p[model]) + 65536 * seen) // (weight + 1)
                p = min(max(guess, 32), 65504) + numbers.number(rest)
                require(32 <= p <= 65504, "snapshot", "a model's probability out of range")
                self.p[model] = p


def count_below(x, limits):
    """How many of the limits are below x."""
    return np.searchsorted(np.array(limits), x, side="left")


def bucket(x):
    """The class of a time in frames."""
    return count_below(x, (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 40, 64, 128, 250))


def side(x, limit):
    """0 below -limit, 2 above limit, 1 between."""
    return np.where(x < -limit, 0, np.where(x > limit, 2, 1))


class StepContexts:
    """The models of the steps of one group, from its columns and from c (or 0) and v (or w) compared with limits."""

    def __init__(self, first, columns, c, v, limits):
        now, interval, last = columns[AGE] + 1, columns[INTERVAL], columns[LAST]
        self.first = first
        self.ages = count_below(now, (2, 4, 8, 20))
        self.length = np.clip(np.abs(last).max(axis=0), 1, 3) - 1
        axis = np.arange(3).reshape(3, 1)
        times = self.ages * 4 + count_below(interval, (2, 6, 20))
        self.zero = first + (axis * 20 + times) * 6 + (last != 0)
        sides = side(last, 0) * 9 + side(c, limits[0]) * 3 + side(v, limits[1])
        self.sign = first + SIGN - ZERO + (axis * 27 + sides) * 4 + count_below(now, (2, 6, 20))
        lengths = np.abs(last)
        classes = count_below(lengths + lengths.sum(axis=0), (1, 4, 10, 24))
        recent = np.where(now > 1, 2, np.abs(v) > limits[2])
        self.size = first + SIZE - ZERO + (classes * 3 + recent) * 36
        self.place = first + PLACE - ZERO
        self.escape = first + ESCAPE - ZERO


class Contexts:
    """The models that the decisions of each slot use, from the predicted state and the columns before the delta."""

    def __init__(self, state, renewed, threshold):
        columns, v = state.codec[:GROUP], np.where(renewed, 0, state.v)
        rest = np.where(renewed, 0, state.rest)
        limits = threshold // 32, threshold + threshold // 4, 96 * threshold
        self.position = StepContexts(ZERO, columns, np.where(renewed, 0, state.c), v, limits)
        now, interval, length = columns[AGE] + 1, columns[INTERVAL], self.position.length
        if state.orientation:
            turns = state.codec[GROUP:]
            w = np.where(renewed, 0, state.w)
            self.turn = StepContexts(TURN, turns, np.zeros_like(w), w, (0, SLOW_TURN, FAST_TURN))
            last = np.where(columns[AGE] == turns[AGE], 0, np.where(columns[AGE] < turns[AGE], 1, 2))
            self.choice = (last * 5 + self.position.ages) * 5 + self.turn.ages
            now = np.minimum(now, turns[AGE] + 1)
            both = np.stack([interval, turns[INTERVAL]])
            interval = np.where(both.min(axis=0) > 0, both.min(axis=0), both.max(axis=0))
            length = np.maximum(length, self.turn.length)
        moving = FLAG + bucket(now) * 45 + bucket(interval) * 3 + length
        self.flag = np.where(rest, FLAG_AT_REST + bucket(now), moving)
        fastest = np.abs(v).max(axis=0)
        speed = sum((fastest > min(MOST_V, limit * threshold)).astype(int) for limit in (20, 64))
        self.rest = REST + (rest * 5 + self.position.ages) * 3 + speed


@dataclass
class Correction:
    """The correction of a body; steps are None where a group is not corrected."""

    rest: int
    steps: list = None
    turn: list = None
    fine: int = 0


@dataclass
class Setting:
    """The input of corrections besides stream and parameters: rounding of p in bits, gravity of the frame."""

    rounding: int
    gravity: tuple


def read_correction(decoder, contexts, slot, orientation):
    """The correction of one body."""
    correction = Correction(decoder.decide(int(contexts.rest[slot])))
    moves, turns = 1, 0
    if orientation:
        choice = int(contexts.choice[slot])
        if decoder.decide(BOTH + choice):
            turns = 1
            correction.fine = decoder.decide(FINE)
        else:
            turns = decoder.decide(WHICH + choice)
            moves = 1 - turns
    if moves:
        correction.steps = read_steps(decoder, contexts.position, slot)
    if turns:
        correction.turn = read_steps(decoder, contexts.turn, slot)
    return correction


def read_steps(decoder, contexts, slot):
    """The steps of a corrected group, axis by axis."""
    steps, moved = [0, 0, 0], 0
    for axis in range(3):
        asked = axis < 2 or moved > 0
        if asked and not decoder.decide(int(contexts.zero[axis, slot]) + 2 * moved):
            continue
        negative = decoder.decide(int(contexts.sign[axis, slot]))
        models = int(contexts.size[axis, slot]) + 12 * longest_class(steps)
        size = read_size(decoder, models, contexts)
        steps[axis] = -size if negative else size
        moved += 1
    return steps


def longest_class(steps):
    """The class of the longest of the steps so far."""
    return int(count_below(max(abs(each) for each in steps), (0, 2)))


def read_size(decoder, models, contexts):
    """The absolute value of steps that are not 0; `models` is the first of those of its class."""
    found = 0
    while found < 12 and decoder.decide(models + found):
        found += 1
    if found < 12:
        count = CLASSES[found + 1] - CLASSES[found]
        if count == 1:
            return CLASSES[found]
        place = decoder.decide(contexts.place + found - 4)
        for _ in range(count.bit_length() - 2):
            place = place << 1 | decoder.even()
        return CLASSES[found] + place
    bits = 0
    while bits < 31 and decoder.decide(contexts.escape + bits):
        bits += 1
    number = 1
    for _ in range(bits):
        number = number << 1 | decoder.even()
    require(number + 64 <= MOST_STEPS, "values", "more than 2^31 - 1 steps")
    return number + 64


def apply_corrections(world, stream, corrections, renewed, setting):
    """Decode and apply the sections of all blocks, let the models learn and the ages grow."""
    state, models, values = world.state, world.models, parameters.named(world.parameters)
    contexts = Contexts(state, renewed, values["threshold"])
    zeros, ones = [0] * len(models.p), [0] * len(models.p)
    corrected = {}
    for block, body in corrections:
        first, end = state.block_slots(block)
        decoder = CountingDecoder(body.rest(), models.p.tolist(), zeros, ones)
        alive = first + np.flatnonzero(state.alive[first:end])
        flags = contexts.flag[alive].tolist()
        slots = [slot for slot, flag in zip(alive.tolist(), flags) if decoder.decide(flag)]
        require(slots, "corrections", f"block {block}: no body is corrected")
        for slot in slots:
            corrected[slot] = read_correction(decoder, contexts, slot, state.orientation)
        decoder.end()
    if not corrections:
        zeros = np.bincount(contexts.flag[state.alive], minlength=len(models.p))
    models.learn(np.array(zeros), np.array(ones))
    for group in range(0, len(state.codec), GROUP):
        of_group = [slot for slot, what in corrected.items() if (what.turn if group else what.steps)]
        grows = state.alive & ~renewed
        grows[of_group] = False
        state.codec[group + AGE, grows] = np.minimum(state.codec[group + AGE, grows] + 1, 254)
    correct(state, corrected, values, stream, setting)


def by_axes(steps, long, one, two, three):
    """A number chosen by the steps: where one exceeds 1, else by how many axes have steps that are not 0."""
    axes = (steps != 0).sum(axis=0)
    short = np.where(axes == 3, three, np.where(axes == 2, two, one))
    return np.where(np.abs(steps).max(axis=0) > 1, long, short)


@dataclass
class Group:
    """The corrected bodies of one group: their slots and steps, and what the codec remembers of it."""

    slots: np.ndarray
    steps: np.ndarray
    fine: np.ndarray
    columns: np.ndarray

    @classmethod
    def of(cls, corrected, what, columns):
        """Choose from {slot: Correction} those where `what` is corrected; None if there is none."""
        slots = [slot for slot, correction in corrected.items() if getattr(correction, what)]
        if not slots:
            return None
        steps = np.array([getattr(corrected[slot], what) for slot in slots], np.int64).T
        return cls(np.array(slots), steps, np.array([corrected[slot].fine for slot in slots]), columns)

    def unit(self, threshold, orientation, rounding):
        """Lattice units that a step is worth."""
        share = by_axes(self.steps, 62259, 60293, 45220, 38666)
        if orientation:
            share = (share * np.where(self.fine, 27525, 48497)) >> 16
        return np.maximum(1 << rounding, ((threshold * share) >> 16) >> rounding << rounding)

    def growth(self, one, gain, whole=False):
        """Return what a step adds to v, c or w, in 1/64 of its unit; `gain` is called with `now`. Long steps of a body that was
        corrected in the frame before add all of it, if `whole`."""
        last, kept = self.columns[LAST, self.slots], clamp(self.steps, 127)
        before = last * by_axes(last, 243, 235, 176, 151)
        after = kept * by_axes(kept, 243, 235, 176, 151)
        trust = 256 + (clamp((before * after).sum(axis=0) >> 8, 256) >> 1)
        now = self.columns[AGE, self.slots] + 1
        far = (now == 1) & (np.abs(self.steps).max(axis=0) >= LONG_STEPS)
        trust = np.where(far, 256, trust)
        gain_of_now = np.where(far & whole, 2**22, gain(now))
        return np.minimum(2**29, (((one * gain_of_now + 2**15) >> 16) * trust + 128) >> 8)

    def remember(self):
        """Store these corrections as the last ones."""
        self.columns[INTERVAL, self.slots] = self.columns[AGE, self.slots] + 1
        self.columns[AGE, self.slots] = 0
        self.columns[LAST, self.slots] = clamp(self.steps, 127)


def correct(state, corrected, values, stream, setting):
    """Move and turn bodies by their steps, adjust their velocities and accelerations, put them to rest or wake them."""
    threshold = values["threshold"]
    gain = 128 * values["velocity_gain"]

    def for_v(now):
        divisor = np.where(now <= 3, 3, now)
        return gain // (np.where(now == 1, 2, divisor) if stream.predictor in ("ballistic", "rigid") else divisor)

    def for_c(now):
        return ((gain * values["acceleration_gain"]) >> 16) // np.maximum(now, 3) ** 2

    moved = Group.of(corrected, "steps", state.codec[:GROUP])
    if moved:
        slots, steps = moved.slots, moved.steps
        unit = moved.unit(threshold, state.orientation, setting.rounding)
        most_c = min(MOST_C, max(256 * threshold, 2 * max(abs(g) for g in setting.gravity)))
        state.p[:, slots] = clamp(state.p[:, slots] + clamp(steps * unit, 2**31), MOST_P)
        state.v[:, slots] = clamp(state.v[:, slots] + clamp(steps * moved.growth(unit, for_v, True), 2**29), MOST_V)
        state.c[:, slots] = clamp(state.c[:, slots] + clamp(steps * moved.growth(unit, for_c), 2**29), most_c)
        moved.remember()
    turned = Group.of(corrected, "turn", state.codec[GROUP:])
    if turned:
        slots, steps = turned.slots, turned.steps
        radii = np.array(stream.radii, np.int64)[state.type[slots]]
        unit = turned.unit(threshold, True, setting.rounding)
        angle = np.clip((unit << 28) // radii, 1, turn.MOST_W)
        state.q[:, slots], far = turn.turned_by(state.q[:, slots], steps * angle)
        w = turn.limited(state.w[:, slots] + steps * (turned.growth(angle, for_v, True) >> 6))
        state.w[:, slots] = np.where(far, state.w[:, slots], w)
        turned.remember()
    slots = np.array(list(corrected), np.int64)
    state.rest[slots] = [correction.rest for correction in corrected.values()]
    still = [slot for slot, correction in corrected.items() if correction.rest]
    state.v[:, still] = 0
    state.w[:, still] = 0
    state.c[:, still] = -np.array(setting.gravity, np.int64).reshape(3, 1)
