"""The predictor `rigid`: the step, and where solids touch."""

from .step import World, read_world, step

__all__ = ["World", "read_world", "step"]
