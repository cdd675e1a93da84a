"""The binary range decoder, for the codec `tracker`, whose models stay as they are in a delta, and for snapshots."""

from .errors import require

SHORT = 8  # bits of a number whose sign and leading bits have models


class RangeDecoder:
    """Decodes decisions from a code stream."""

    def __init__(self, data, rule):
        require(not data or data[-1] != 0, rule, "a code stream that ends with a zero")
        self.data = data
        self.rule = rule
        self.at = 4
        self.code = int.from_bytes(data[:4].ljust(4, b"\0"), "big")
        self.range = 2**32 - 1

    def decision(self, probability):
        """A decision with the probability of a 1 in 1/65536."""
        bound = (self.range * probability) >> 16
        one = self.code < bound
        if one:
            self.range = bound
        else:
            self.code -= bound
            self.range -= bound
        self.fill()
        return one

    def even_bits(self, count):
        """A number of up to 16 bits, each of which is as likely 0 as 1."""
        share, last = self.range >> count, (1 << count) - 1
        value = min(self.code // share, last)
        self.code -= share * value
        self.range = self.range - share * value if value == last else share
        self.fill()
        return value

    def fill(self):
        """Take in bytes until the range has 25 bits at least."""
        while self.range < 2**24:
            following = self.data[self.at] if self.at < len(self.data) else 0
            self.at += 1
            self.code = (256 * self.code + following) & 0xFFFFFFFF
            self.range *= 256

    def end(self):
        """Refuse bytes behind the last decision."""
        require(self.at >= len(self.data), self.rule, "bytes left over in a code stream")


class CountingDecoder(RangeDecoder):
    """Decodes decisions of models that learn after the delta, and counts them."""

    def __init__(self, data, probabilities, zeros, ones):
        require(len(data) > 0, "stream", "an empty code stream")
        super().__init__(data, "stream")
        self.probabilities = probabilities
        self.zeros, self.ones = zeros, ones

    def decide(self, model):
        """A decision of a model; True is a 1."""
        one = self.decision(self.probabilities[model])
        if one:
            self.ones[model] += 1
        else:
            self.zeros[model] += 1
        return one

    def even(self):
        """A decision without a model."""
        return self.decision(32768)


# Numbers of a snapshot: a range code whose models learn from every decision.


class Model:
    """The probability of a 1, in 1/65536, and `seen`: 1 more than the decisions so far, up to 127."""

    def __init__(self):
        self.p, self.seen = 32768, 1

    def learn(self, one):
        """Learn from a decision."""
        rate = self.seen.bit_length()
        self.p = self.p + ((65536 - self.p) >> rate) if one else self.p - (self.p >> rate)
        self.seen = min(self.seen + 1, 127)


class NumberModels:
    """The models of a kind of numbers."""

    def __init__(self):
        self.some = Model()
        self.length = [Model() for _ in range(32)]
        self.sign = [Model() for _ in range(SHORT + 1)]
        self.next = [[Model() for _ in range(4)] for _ in range(SHORT + 1)]


class NumberDecoder(RangeDecoder):
    """Decodes numbers from the code stream of a snapshot."""

    def __init__(self, data, rule="snapshot"):
        super().__init__(data, rule)

    def decide(self, model):
        """A decision of a model; True is a 1."""
        one = self.decision(model.p)
        model.learn(one)
        return one

    def number(self, models):
        """Decode a number of a kind."""
        if not self.decide(models.some):
            return 0
        node = 1
        for _ in range(5):
            node = 2 * node + self.decide(models.length[node])
        bits = node - 31
        value, left = 1, bits - 1
        if bits > SHORT:
            high = min(left, 15)
            both = self.even_bits(high + 1)
            negative, value, left = both & 1, value << high | both >> 1, left - high
        else:
            negative = self.decide(models.sign[bits])
            while left > 0 and value < 4:
                value = 2 * value + self.decide(models.next[bits][value])
                left -= 1
        if left > 0:
            value = value << left | self.even_bits(left)
        return -value if negative else value
