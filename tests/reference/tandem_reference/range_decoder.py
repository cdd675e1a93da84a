"""The binary range decoder of the codec `tracker`."""

from .errors import require


class RangeDecoder:
    """Decodes decisions from a code stream and counts them by model."""

    def __init__(self, data, probabilities, zeros, ones):
        require(len(data) > 0, "stream", "an empty code stream")
        require(data[-1] != 0, "stream", "a code stream that ends with a zero")
        self.data = data
        self.at = 4
        self.code = int.from_bytes(data[:4].ljust(4, b"\0"), "big")
        self.range = 2**32 - 1
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

    def decision(self, probability):
        """A decision with the probability of a 1 in 1/65536."""
        bound = (self.range * probability) >> 16
        one = self.code < bound
        if one:
            self.range = bound
        else:
            self.code -= bound
            self.range -= bound
        while self.range < 2**24:
            following = self.data[self.at] if self.at < len(self.data) else 0
            self.at += 1
            self.code = (256 * self.code + following) & 0xFFFFFFFF
            self.range *= 256
        return one

    def end(self):
        """Refuse bytes behind the last decision."""
        require(self.at >= len(self.data), "stream", "bytes left over in a code stream")
