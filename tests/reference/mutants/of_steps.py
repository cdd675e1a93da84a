"""Mutants of the predicted step without contact, of the turn, of the drive. What a mutant is: README.md."""

# (module, what the stranger does, old text, new text)
MUTANTS = [
    # Rest and waking.
    ("predict", "a body wakes only if all three axes of c + g differ from 0",
     "np.any(state.c + gravity != 0, axis=0)", "np.all(state.c + gravity != 0, axis=0)"),
    ("predict", "a body keeps its rest where c = g, not where c = -g",
     "state.c + gravity != 0", "state.c - gravity != 0"),
    ("predict", "a change of gravity wakes nobody", "state.rest &= ~np.any(state.c + gravity != 0, axis=0)", "pass"),
    ("predict", "damping wakes bodies, too",
     "state.c + gravity != 0, axis=0)", "(state.c + gravity != 0) | (drive.damping > 0), axis=0)"),
    ("predict", "a body that wakes moves from the next step on",
     "    state.rest &= ~np.any(state.c + gravity != 0, axis=0)\n"
     "    moving = np.flatnonzero(state.alive & ~state.rest)\n",
     "    moving = np.flatnonzero(state.alive & ~state.rest)\n"
     "    state.rest &= ~np.any(state.c + gravity != 0, axis=0)\n"),
    ("predict", "c of a body at rest decays",
     "    if state.orientation:\n",
     "    state.c[:, state.rest] -= (state.c[:, state.rest] * decay + 2**15) >> 16\n"
     "    if state.orientation:\n"),
    ("predict", "a velocity wakes a body, too",
     "np.any(state.c + gravity != 0, axis=0)", "np.any((state.c + gravity != 0) | (state.v != 0), axis=0)"),
    # The step of `ballistic`.
    ("predict", "c decays before it is added to v",
     "    v += gravity + c\n"
     "    c -= (c * decay + 2**15) >> 16\n",
     "    c -= (c * decay + 2**15) >> 16\n"
     "    v += gravity + c\n"),
    ("predict", "v is damped before gravity and c are added",
     "    v += gravity + c\n"
     "    c -= (c * decay + 2**15) >> 16\n"
     "    v -= (v * damping + 2**15) >> 16\n",
     "    v -= (v * damping + 2**15) >> 16\n"
     "    v += gravity + c\n"
     "    c -= (c * decay + 2**15) >> 16\n"),
    ("predict", "p moves by the velocity of the frame before",
     "    p += (v + 32) >> 6\n", "    p += (state.v[:, moving] + 32) >> 6\n"),
    ("predict", "the decay is not rounded to the nearest", "c -= (c * decay + 2**15) >> 16", "c -= (c * decay) >> 16"),
    ("predict", "the decay multiplies by what remains, which rounds halves the other way",
     "c -= (c * decay + 2**15) >> 16", "c = (c * (2**16 - decay) + 2**15) >> 16"),
    ("predict", "the damping is not rounded to the nearest",
     "v -= (v * damping + 2**15) >> 16", "v -= (v * damping) >> 16"),
    ("predict", "the damping multiplies by what remains, which rounds halves the other way",
     "v -= (v * damping + 2**15) >> 16", "v = (v * (2**16 - damping) + 2**15) >> 16"),
    ("predict", "v / 64 is rounded down", "p += (v + 32) >> 6", "p += v >> 6"),
    ("predict", "halves of v / 64 are rounded away from zero",
     "p += (v + 32) >> 6", "p += np.sign(v) * ((np.abs(v) + 32) >> 6)"),
    ("predict", "v is not clamped", "    v = np.clip(v, -MOST_V, MOST_V)\n", ""),
    ("predict", "v is clamped before it is damped",
     "    v += gravity + c\n", "    v = np.clip(v + gravity + c, -MOST_V, MOST_V)\n"),
    ("predict", "p is not clamped", "    p = np.clip(p, -MOST_P, MOST_P)\n", ""),
    ("predict", "dead slots move, too", "np.flatnonzero(state.alive & ~state.rest)", "np.flatnonzero(~state.rest)"),
    # When what acts.
    ("timeline", "a new decay holds a frame late",
     "predict.step(self.world.state, self.stream, self.world.parameters, self.drive, before)",
     "old, self.decay = getattr(self, 'decay', self.world.parameters[4]), self.world.parameters[4]\n"
     "        predict.step(self.world.state, self.stream, {**self.world.parameters, 4: old}, self.drive, before)"),
    ("timeline", "a scheduled input acts a frame early", "if acts_on == self.frame:", "if acts_on == self.frame + 1:"),
    ("timeline", "of several inputs for a frame the lowest number counts",
     "for number in sorted(self.inputs):", "for number in sorted(self.inputs, reverse=True):"),
    ("timeline", "a scheduled input acts in its frame alone",
     "        predict.step(self.world.state, self.stream, self.world.parameters, self.drive, before)\n",
     "        predict.step(self.world.state, self.stream, self.world.parameters, self.drive, before)\n"
     "        self.first = getattr(self, 'first', self.drive)\n"
     "        self.drive = self.drive if self.inputs else self.first\n"),
    ("timeline", "an input that the snapshot counts already may come again",
     "        if number > self.last_input:\n", "        if number:\n"),
    ("timeline", "`tracker` takes gravity as it was at the start",
     "self.stream, data, self.drive.gravity)",
     "self.stream, data, self.__dict__.setdefault('old', self.drive).gravity)"),
    ("timeline", "an input changes gravity, not damping",
     "                self.drive = drive\n",
     "                self.drive = predict.Drive(drive.gravity, self.drive.damping)\n"),
    # The turn.
    ("predict", "a body that wakes in the step is not turned in it",
     "    state.rest &= ~np.any(state.c + gravity != 0, axis=0)\n"
     "    moving = np.flatnonzero(state.alive & ~state.rest)\n"
     "    if stream.predictor == \"ballistic\":\n"
     "        force_free_step(state, moving, gravity, decay, drive.damping)\n"
     "    elif stream.predictor == \"hard\":\n",
     "    awake = ~state.rest\n"
     "    state.rest &= ~np.any(state.c + gravity != 0, axis=0)\n"
     "    moving = np.flatnonzero(state.alive & ~state.rest)\n"
     "    if stream.predictor == \"ballistic\":\n"
     "        force_free_step(state, moving, gravity, decay, drive.damping)\n"
     "        moving = np.flatnonzero(state.alive & awake)\n"
     "    elif stream.predictor == \"hard\":\n"),
    ("predict", "damping slows the turn, too",
     "    if state.orientation:\n",
     "    if state.orientation:\n"
     "        state.w[:, moving] -= (state.w[:, moving] * drive.damping + 2**15) >> 16\n"),
    ("turn", "w turns about the body's own axes",
     "        c * a + x * e + y * d - z * b,\n"
     "        c * b - x * d + y * e + z * a,\n"
     "        c * d + x * b - y * a + z * e,\n",
     "        c * a + x * e - y * d + z * b,\n"
     "        c * b + x * d + y * e - z * a,\n"
     "        c * d - x * b + y * a + z * e,\n"),
    ("turn", "q comes w first", "    a, b, d, e = q\n", "    e, a, b, d = q\n"),
    ("turn", "the whole angle is taken for the half",
     "series(t, (110, 72, 42, 20, 6))) >> 29", "series(t, (110, 72, 42, 20, 6))) >> 28"),
    ("turn", "the sine's axes are rounded",
     "x, y, z = (w * series(t, (110, 72, 42, 20, 6))) >> 29",
     "x, y, z = (w * series(t, (110, 72, 42, 20, 6)) + 2**28) >> 29"),
    ("turn", "each square is quartered before the sum",
     "times(w, w).sum(axis=0) >> 2", "(times(w, w) >> 2).sum(axis=0)"),
    ("turn", "the squares are added before they are shifted",
     "t = times(w, w).sum(axis=0) >> 2", "t = (w * w).sum(axis=0) >> 30"),
    ("turn", "m() rounds to the nearest", "return (a * b) >> 28", "return (a * b + 2**27) >> 28"),
    ("turn", "R_d is rounded down", "(2**28 + divisor // 2) // divisor", "2**28 // divisor"),
    ("turn", "H() divides by d instead of multiplying by R_d",
     "times(times(n, t), (2**28 + divisor // 2) // divisor)", "times(n, t) // divisor"),
    ("turn", "the sine's last term is left out", "(110, 72, 42, 20, 6)", "(72, 42, 20, 6)"),
    ("turn", "the cosine's last term is left out", "(90, 56, 30, 12, 2)", "(56, 30, 12, 2)"),
    ("turn", "whole() rounds down", "clamp((x + 2**29) >> 30, ONE)", "clamp(x >> 30, ONE)"),
    ("turn", "whole() does not clamp", "clamp((x + 2**29) >> 30, ONE)", "(x + 2**29) >> 30"),
    ("turn", "whole() rounds halves away from zero",
     "clamp((x + 2**29) >> 30, ONE)", "clamp(np.sign(x) * ((np.abs(x) + 2**29) >> 30), ONE)"),
    ("turn", "the norm is rounded down", "((norm + 2**28) >> 29)", "(norm >> 29)"),
    ("turn", "the norm is not mended", "return to_unit(r * (3 * 2**29 - ((norm + 2**28) >> 29)))", "return r"),
    ("turn", "the length of w is not looked at",
     "return short & ((w * w * short).sum(axis=0) <= MOST_W**2)", "return short"),
    ("turn", "w of exactly 2 rad is out of range", ".sum(axis=0) <= MOST_W**2)", ".sum(axis=0) < MOST_W**2)"),
    ("turn", "halving w rounds towards zero",
     "w[:, ~fits] >>= 1", "w[:, ~fits] = np.sign(w[:, ~fits]) * (np.abs(w[:, ~fits]) >> 1)"),
    ("turn", "w that is out of range is cut axis by axis",
     "    while not np.all(fits := is_spin(w)):\n"
     "        w[:, ~fits] >>= 1\n"
     "    return w\n",
     "    return np.where(is_spin(w), w, clamp(w, MOST_W * 591 // 1024))\n"),
    ("turn", "q may be twice as far from the norm", "NORM_SLACK = 2**48", "NORM_SLACK = 2**49"),
    ("turn", "q at the limit of the norm is out of range", "<= NORM_SLACK", "< NORM_SLACK"),
]  # fmt: skip

# The same, and why no agreed state depends on it.
EQUIVALENT = [
    ("snapshot", "w of q may be beyond 1 in its column",
     'require(-most <= value <= most, "snapshot", f"a value of {value}")', "pass",
     "what is beyond 1 is no quaternion, and refused as such"),
    ("turn", "the squares of the norm are added before they are shifted",
     "    norm = ((r * r) >> 2).sum(axis=0)\n    return",
     "    norm = (r * r).sum(axis=0) >> 2\n    return",
     "they differ by 1, where all four are odd; a quarter of the sum is then odd, so that both are rounded alike"),
    ("turn", "the mended q is not clamped",
     "    return to_unit(r * (3 * 2**29 - ((norm + 2**28) >> 29)))",
     "    return (r * (3 * 2**29 - ((norm + 2**28) >> 29)) + 2**29) >> 30",
     "r is clamped, and mending multiplies a component of 1 - e by 1 + e at most"),
]  # fmt: skip
