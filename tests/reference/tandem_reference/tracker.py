"""The codec `tracker`: models, contexts, and the filter that corrects a body."""

from dataclasses import dataclass

import numpy as np

from . import parameters
from .errors import require
from .integers import clamp
from .number_decoder import NumberModels
from .range_decoder import CountingDecoder
from .state import MOST_C, MOST_P, MOST_V

FLAG, FLAG_AT_REST, REST, ZERO, SIGN, MAGNITUDE, ESCAPE = 0, 675, 690, 720, 1080, 1404, 1908
MODELS = 1940
AGE, INTERVAL, LAST = 0, 1, slice(2, 5)
MOST_STEPS = 2**31 - 1


class Models:
    """Probability of a 1 (in 1/65536) and weight of every model, in the order of the specification."""

    def __init__(self):
        self.p = np.full(MODELS, 32768, np.int64)
        self.p[FLAG:ZERO] = 4096
        self.weight = np.zeros(MODELS, np.int64)

    def copy(self):
        """The same models in arrays of their own."""
        twin = object.__new__(Models)
        twin.p, twin.weight = self.p.copy(), self.weight.copy()
        return twin

    def learn(self, zeros, ones):
        """What the decisions of a delta teach: how many of each model were 0 and 1."""
        made = zeros + ones > 0
        seen = self.weight + 1 + zeros + ones
        learnt = np.clip(((self.weight + 1) * self.p + 65536 * ones) // seen, 32, 65504)
        self.p = np.where(made, learnt, self.p)
        self.weight = np.where(made, np.minimum(255, self.weight + zeros + ones), self.weight)

    def read(self, numbers):
        """Take the models of a snapshot."""
        weights, probabilities, before = NumberModels(), NumberModels(), 32768
        for model in range(MODELS):
            lacks = numbers.number(weights)
            require(0 <= lacks <= 255, "snapshot", f"a model that lacks {lacks} of its weight")
            self.weight[model] = -lacks % 256
            if lacks:
                before += numbers.number(probabilities)
                require(32 <= before <= 65504, "snapshot", "a model's probability out of range")
                self.p[model] = before


def count_below(x, limits):
    """How many of the limits are below x."""
    return np.searchsorted(np.array(limits), x, side="left")


def bucket(x):
    """The class of a time in frames."""
    return count_below(x, (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 40, 64, 128, 250))


def side(x, limit):
    """0 below -limit, 2 above limit, 1 between."""
    return np.where(x < -limit, 0, np.where(x > limit, 2, 1))


class Contexts:
    """The models that the decisions of each slot use, from the predicted state and the columns before the delta."""

    def __init__(self, state, renewed, threshold):
        now, interval, last = state.codec[AGE] + 1, state.codec[INTERVAL], state.codec[LAST]
        v, c = np.where(renewed, 0, state.v), np.where(renewed, 0, state.c)
        length = np.clip(np.abs(last).max(axis=0), 1, 3) - 1
        axis = np.arange(3).reshape(3, 1)
        rest = np.where(renewed, 0, state.rest)
        moving = FLAG + bucket(now) * 45 + bucket(interval) * 3 + length
        self.flag = np.where(rest, FLAG_AT_REST + bucket(now), moving)
        ages = count_below(now, (2, 4, 8, 20))
        fastest = np.abs(v).max(axis=0)
        speed = sum((fastest > min(MOST_V, limit * threshold)).astype(int) for limit in (20, 64))
        self.rest = REST + (rest * 5 + ages) * 3 + speed
        self.zero = ZERO + (axis * 20 + ages * 4 + count_below(interval, (2, 6, 20))) * 6 + (last != 0)
        sides = side(last, 0) * 9 + side(c, threshold // 32) * 3 + side(v, threshold + threshold // 4)
        self.sign = SIGN + (axis * 27 + sides) * 4 + count_below(now, (2, 6, 20))
        self.magnitude = MAGNITUDE + (count_below(now, (1, 4, 20)) * 3 + length) * 42


@dataclass
class Setting:
    """What corrections depend on beside stream and parameters: rounding of p in bits, gravity of the frame."""

    rounding: int
    gravity: tuple


def read_steps(decoder, contexts, slot):
    """The steps of a corrected body, axis by axis."""
    steps, moved = [0, 0, 0], 0
    for axis in range(3):
        asked = axis < 2 or moved > 0
        if asked and not decoder.decide(int(contexts.zero[axis, slot]) + 2 * moved):
            continue
        negative = decoder.decide(int(contexts.sign[axis, slot]))
        size = read_size(decoder, int(contexts.magnitude[slot]) + 14 * moved)
        steps[axis] = -size if negative else size
        moved += 1
    return steps


def read_size(decoder, magnitude):
    """The absolute value of steps that are not 0; `magnitude` is the first of the 14 models."""
    size = 1
    while size <= 14 and decoder.decide(magnitude + size - 1):
        size += 1
    if size <= 14:
        return size
    bits = 0
    while bits < 31 and decoder.decide(ESCAPE + bits):
        bits += 1
    number = 1
    for _ in range(bits):
        number = number << 1 | decoder.even()
    require(number + 14 <= MOST_STEPS, "values", "more than 2^31 - 1 steps")
    return number + 14


def apply_corrections(world, stream, corrections, renewed, setting):
    """Decode and apply the sections of all blocks, let the models learn and the ages grow."""
    state, models, values = world.state, world.models, parameters.named(world.parameters)
    contexts = Contexts(state, renewed, values["threshold"])
    zeros, ones = [0] * MODELS, [0] * MODELS
    slots, rests, steps = [], [], []
    for block, body in corrections:
        first, end = state.block_slots(block)
        decoder = CountingDecoder(body.rest(), models.p.tolist(), zeros, ones)
        alive = first + np.flatnonzero(state.alive[first:end])
        flags = contexts.flag[alive].tolist()
        corrected = [slot for slot, flag in zip(alive.tolist(), flags) if decoder.decide(flag)]
        require(corrected, "corrections", f"block {block}: no body is corrected")
        for slot in corrected:
            rests.append(decoder.decide(int(contexts.rest[slot])))
            steps.append(read_steps(decoder, contexts, slot))
        slots += corrected
        decoder.end()
    if not corrections:
        zeros = np.bincount(contexts.flag[state.alive], minlength=MODELS)
    models.learn(np.array(zeros), np.array(ones))
    slots = np.array(slots, np.int64)
    grows = state.alive & ~renewed
    grows[slots] = False
    state.codec[AGE, grows] = np.minimum(state.codec[AGE, grows] + 1, 254)
    if len(slots):
        correct(state, slots, np.array(steps, np.int64).T, values, stream.predictor == "ballistic", setting)
        put_to_rest(state, slots, np.array(rests), setting.gravity)


def by_axes(steps, long, one, two, three):
    """A number chosen by the steps: where one exceeds 1, else by how many axes have steps that are not 0."""
    axes = (steps != 0).sum(axis=0)
    short = np.where(axes == 3, three, np.where(axes == 2, two, one))
    return np.where(np.abs(steps).max(axis=0) > 1, long, short)


def put_to_rest(state, slots, rests, gravity):
    """Of corrected bodies, those put to rest stand and hold themselves up; the others are awake."""
    state.rest[slots] = rests
    still = slots[rests == 1]
    state.v[:, still] = 0
    state.c[:, still] = -np.array(gravity, np.int64).reshape(3, 1)


def correct(state, slots, steps, values, ballistic, setting):
    """Move bodies by their steps, and adjust their velocity, acceleration and columns."""
    threshold, rounding = values["threshold"], setting.rounding
    now, last = state.codec[AGE, slots] + 1, state.codec[LAST, slots]
    share = by_axes(steps, 62259, 60293, 45220, 38666)
    unit = np.maximum(1 << rounding, ((threshold * share) >> 16) >> rounding << rounding)

    kept = clamp(steps, 127)
    before = last * by_axes(last, 243, 235, 176, 151)
    after = kept * by_axes(kept, 243, 235, 176, 151)
    agreement = clamp((before * after).sum(axis=0) >> 8, 256)
    trust = 256 + (agreement >> 1)

    gain = 128 * values["velocity_gain"]
    divisor = np.where(now <= 3, 3, now)
    if ballistic:
        divisor = np.where(now == 1, 2, divisor)
    for_v = gain // divisor
    both = (gain * values["acceleration_gain"]) >> 16
    for_c = both // np.maximum(now, 3) ** 2

    most_c = min(MOST_C, max(256 * threshold, 2 * max(abs(g) for g in setting.gravity)))

    def adjustment(gain_of):
        one = np.minimum(2**29, (((unit * gain_of + 2**15) >> 16) * trust + 128) >> 8)
        return clamp(steps * one, 2**29)

    state.p[:, slots] = clamp(state.p[:, slots] + clamp(steps * unit, 2**31), MOST_P)
    state.v[:, slots] = clamp(state.v[:, slots] + adjustment(for_v), MOST_V)
    state.c[:, slots] = clamp(state.c[:, slots] + adjustment(for_c), most_c)
    state.codec[INTERVAL, slots] = now
    state.codec[AGE, slots] = 0
    state.codec[LAST, slots] = kept
