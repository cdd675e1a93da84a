"""Mutants of the predictor `hard`. What a mutant is: README.md."""

# (module, what the stranger does, old text, new text)
MUTANTS = [
    # Constants and parameters.
    ("hard", "the solver's unit has a bit more", ".bit_length() - 10)", ".bit_length() - 11)"),
    ("hard", "radii are longer by a share that is rounded down", "values[9] + 2**15) >> 16)", "values[9]) >> 16)"),
    ("hard", "the reach is the threshold, however small bodies are", "min(values[1], self.largest)", "values[1]"),
    ("hard", "walls know nothing of their distance", "longer = radius + frame.wall", "longer = radius"),
    # Order and waves.
    ("hard", "neighbours come before the own cell",
     "        for other in range(place + 1, first[cell] + held[cell]):\n            yield place, other\n", ""),
    ("hard", "rows are visited in another order", "rows = (1, 0), (-1, 1), (0, 1), (1, 1)", "rows = (1, 0), (0, 1), (-1, 1), (1, 1)"),
    ("hard", "there are 32 waves of pairs", "PAIR_WAVES, WAVES = 20, 26", "PAIR_WAVES, WAVES = 32, 38"),
    ("hard", "bodies that nothing moves have waves, too",
     "if body < len(self.mobility) and self.mobility[body]]", "if body < len(self.mobility)]"),
    # Contacts.
    ("hard", "bodies far apart that come nearer do not touch", "min(0, int((u * n).sum()) >> 12)", "0"),
    ("hard", "n is rounded down", "(2**40 // far) + 2**27) >> 28", "(2**40 // far)) >> 28"),
    ("hard", "all bodies weigh the same", "int(mobility[body]) * WHOLE // both", "WHOLE // 2"),
    ("hard", "geometry moves, too", "(MOST_WORD, 0)", "(WHOLE // 2, WHOLE // 2)"),
    # Sub-steps.
    ("hard", "the fall is divided, not shared", "((substep * fall) >> 2) - (((substep - 1) * fall) >> 2)", "(fall >> 2)"),
    ("hard", "sub-steps begin without impulses", "word(fallen + word(w - base)) if substep > 1 else fallen.copy()", "fallen.copy()"),
    ("hard", "all sub-steps have two passes", "range(3 if substep == 1 else 2)", "range(2)"),
    ("hard", "bodies leave each other faster", "PUSH_OUT = 26240", "PUSH_OUT = 32767"),
    ("hard", "bodies may leave each other at any speed", "np.minimum(product(word(-gap), PUSH_OUT), MOST_OUT)", "product(word(-gap), PUSH_OUT)"),
    ("hard", "a gap is closed in a frame", "word(SUBSTEPS * np.minimum(word(frame.slop - gap), 0))", "np.minimum(word(frame.slop - gap), 0)"),
    ("hard", "friction is by the impulse before", "most = product(push, frame.friction)", "most = product(self.push, frame.friction)"),
    ("hard", "the last pass stops what may still close", "wanted = np.minimum(self.wanted, 0)", "wanted = 0"),
    ("hard", "there is no last pass", "    for wave in waves:\n        wave.relax(w)\n", ""),
    ("hard", "products are rounded down", "(x * y + 2**14) >> 15", "(x * y) >> 15"),
    ("hard", "sums of the sub-steps have more than 16 bits", "np.clip(x, -(2**15), 2**15 - 1)", "x"),
    # Sleep.
    ("hard", "nobody sleeps through a frame", "return calm & ~np.isin(cells, near)", "return calm & False"),
    ("hard", "bodies sleep on beside one that moves", "return calm & ~np.isin(cells, near)", "return calm"),
    ("hard", "a body rouses its own layer alone", "for z in steps for y", "for z in (0,) for y"),
    ("hard", "bodies at rest rouse others", "cells[rousing & ~still & ~calm]", "cells[rousing & ~calm]"),
    ("hard", "bodies that move sleep, too", " & ~moving & ~still", " & ~still"),
    ("hard", "gravity may change a little in their sleep", " & ~still & same_gravity", " & ~still"),
    ("hard", "bodies asleep lose their count", "    frames = np.where(asleep, CALM_FRAMES, frames)\n", ""),
    # The end.
    ("hard", "bodies move by the whole change", "((5 * change) >> 3)", "change"),
    ("hard", "damping comes last", "    changed -= (changed * damping + 2**15) >> 16\n", ""),
    ("hard", "one contact is enough for calm", "touched >= 2", "touched >= 1"),
    ("hard", "neighbours need not be slow", "restless[one] |= not slow[other]", "restless[one] |= False"),
    ("hard", "any change of gravity wakes", "(50 * turned <= most)", "(turned == 0)"),
    ("hard", "gravity wakes nobody", " & (50 * turned <= most)", ""),
    ("hard", "a body sleeps a frame later", "CALM_FRAMES = 5", "CALM_FRAMES = 6"),
    ("hard", "a body at rest keeps its count", "quiet = calm(frame, found, slow) & ~still", "quiet = calm(frame, found, slow) | still"),
    ("payload", "a teleport leaves the predictor's column", "            state.own[:, slot] = 0\n", ""),
]
