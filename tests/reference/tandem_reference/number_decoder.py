"""Numbers of a snapshot: a range code whose models learn from every decision."""

from .range_decoder import RangeDecoder

SHORT = 8  # bits of a number whose sign and leading bits have models


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
    """Decodes numbers from the code stream of a region."""

    def __init__(self, data):
        super().__init__(data, "snapshot")

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
