"""The parameters of a stream, which may change from delta to delta."""

from .errors import require

# id: (name, least, most)
PARAMETERS = {
    1: ("threshold", 1, 2**30),
    2: ("position_step", 1, 2**24),
    3: ("velocity_step", 1, 2**24),
    4: ("decay", 0, 65535),
    5: ("velocity_gain", 0, 65535),
    6: ("acceleration_gain", 0, 65535),
    7: ("turn_step", 1, 2**24),
    8: ("spin_step", 1, 2**24),
    9: ("contact_radius", -(2**14), 2**14),
    10: ("wall_distance", -(2**24), 2**24),
    11: ("friction", 0, 2**12),
    12: ("rounding", 0, 2**14),
}
OF_TURNS = 7, 8
OF_CONTACTS = 9, 10, 11, 12
STEPPING = "quantized", "entropy", "limited"


def listed(codec, groups, predictor=""):
    """The ids of the parameters that a stream has."""
    turns = codec in STEPPING and "orientation" in groups
    absent = (() if turns else OF_TURNS) + (() if predictor in ("hard", "rigid") else OF_CONTACTS)
    return [identity for identity in PARAMETERS if identity not in absent]


def check(identity, value, known):
    """Refuse an id that the stream does not list and a value out of range."""
    require(identity in known, "parameters", f"unknown parameter {identity}")
    name, least, most = PARAMETERS[identity]
    require(least <= value <= most, "parameters", f"{name} {value} is not in {least} .. {most}")


def read(reader, known):
    """Read the rest of a section: {id: value}. `known` has the ids that the stream lists."""
    found, before = {}, 0
    while reader.left():
        identity = reader.u8()
        value = reader.zigzag(5)
        check(identity, value, known)
        require(identity > before, "parameters", f"parameter {identity} behind {before}")
        found[identity] = value
        before = identity
    return found


def complete(pairs, known):
    """Return {id: value} from the (id, value) pairs of a session, which must name all that the stream lists, ascending."""
    for identity, value in pairs:
        check(identity, value, known)
    require([identity for identity, _ in pairs] == list(known), "parameters", "not each that the stream has, ascending")
    return dict(pairs)


def named(values):
    """{name: value} of {id: value}."""
    return {PARAMETERS[identity][0]: value for identity, value in values.items()}
