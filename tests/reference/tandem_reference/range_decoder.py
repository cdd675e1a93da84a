"""The binary range decoder, for the codec `tracker`, whose models stay as they are in a delta, and for snapshots."""

from .errors import require


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
