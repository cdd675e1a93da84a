"""The six parameters of a stream, which may change from delta to delta."""

from .errors import require

# id: (name, least, most)
PARAMETERS = {
    1: ("threshold", 1, 2**30),
    2: ("position_step", 1, 2**24),
    3: ("velocity_step", 1, 2**24),
    4: ("decay", 0, 65535),
    5: ("velocity_gain", 0, 65535),
    6: ("acceleration_gain", 0, 65535),
}


def check(identity, value):
    """Refuse an unknown id and a value out of range."""
    require(identity in PARAMETERS, "parameters", f"unknown parameter {identity}")
    name, least, most = PARAMETERS[identity]
    require(least <= value <= most, "parameters", f"{name} {value} is not in {least} .. {most}")


def read(reader):
    """What the rest of a section names: {id: value}."""
    found, before = {}, 0
    while reader.left():
        identity = reader.u8()
        value = reader.zigzag(5)
        check(identity, value)
        require(identity > before, "parameters", f"parameter {identity} behind {before}")
        found[identity] = value
        before = identity
    return found


def complete(pairs):
    """All six from (id, value) pairs in ascending order, as a session names them."""
    for identity, value in pairs:
        check(identity, value)
    require([identity for identity, _ in pairs] == list(PARAMETERS), "parameters", "not each of the six, ascending")
    return dict(pairs)


def named(values):
    """{name: value} of {id: value}."""
    return {PARAMETERS[identity][0]: value for identity, value in values.items()}
