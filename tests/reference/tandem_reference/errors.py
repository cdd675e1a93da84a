"""The one error that says: these bytes break a rule of the protocol."""


class Refused(Exception):
    """Bytes that a reader must refuse; `rule` is one of the words of idl/vectors/README.md."""

    def __init__(self, rule, text):
        super().__init__(f"{rule}: {text}")
        self.rule = rule
        self.text = text


def require(holds, rule, text):
    """Refuse unless something holds."""
    if not holds:
        raise Refused(rule, text)
