"""Mutants of state, payload, lifecycle, the thesis's codecs and snapshots. What a mutant is: README.md."""

# (module, what the stranger does, old text, new text)
MUTANTS = [
    # State and hash.
    ("state", "the type is hashed as one byte",
     'self.type[first:end].astype("<u2")', 'self.type[first:end].astype("u1")'),
    ("state", "reuse is hashed behind the type",
     '            self.reuse[first:end].astype("u1"),\n'
     '            self.type[first:end].astype("<u2"),\n',
     '            self.type[first:end].astype("<u2"),\n'
     '            self.reuse[first:end].astype("u1"),\n'),
    ("state", "the codec's columns are hashed one by one, slot by slot",
     '*(row[first:end].astype("u1") for row in self.codec)', 'self.codec[:, first:end].T.astype("u1")'),
    ("state", "all columns of a block are one leaf",
     'return [xxh3_64(b"".join(column.tobytes() for column in columns)) for columns in (common, *of_groups)]',
     'return [xxh3_64(b"".join(column.tobytes() for columns in (common, *of_groups) for column in columns))]'),
    ("state", "c is no part of the hash", "groups = [(self.p, self.v, self.c)]", "groups = [(self.p, self.v)]"),
    ("state", "w is hashed before q", "[(self.q, self.w)]", "[(self.w, self.q)]"),
    ("state", "the state's hash is the region's",
     'return xxh3_64(self.region_hash().to_bytes(8, "little"))', "return self.region_hash()"),
    ("state", "the leaves of one kind of all blocks come first",
     "leaves = [leaf for block in range(self.blocks()) for leaf in self.leaves(block)]",
     "leaves = [leaf for kind in zip(*(self.leaves(block) for block in range(self.blocks()))) for leaf in kind]"),
    ("state", "a despawn keeps reuse",
     "(self.alive, self.reuse, self.type, self.rest):", "(self.alive, self.type, self.rest):"),
    ("state", "a despawn leaves q = 0, 0, 0, 1",
     "            rows[:, slot] = 0\n",
     "            rows[:, slot] = 0\n"
     "        self.q[3:, slot] = turn.ONE\n"),
    # Lifecycle.
    ("payload", "a gap counts the slots between",
     "        slot += key // 4\n", "        slot += key // 4 + bool(records)\n"),
    ("payload", "gaps are slots", "        slot += key // 4\n", "        slot = key // 4\n"),
    ("payload", "a despawn of the slot spawned before is allowed",
     "require(pair == (DESPAWN, SPAWN),", "require(pair in ((DESPAWN, SPAWN), (SPAWN, DESPAWN)),"),
    ("payload", "bit 0 of a teleport is the orientation",
     "            groups = body.u8()\n", "            groups = (0, 2, 1, 3, 4, 5, 6, 7)[body.u8() & 7]\n"),
    ("payload", "a teleport of both groups has the orientation first",
     "        if groups & 1:\n"
     "            record.columns |= read_position(body)\n"
     "        if groups & 2:\n"
     "            record.columns |= read_orientation(body)\n",
     "        if groups & 2 and record.kind == TELEPORT:\n"
     "            record.columns |= read_orientation(body)\n"
     "        if groups & 1:\n"
     "            record.columns |= read_position(body)\n"
     "        if groups & 2 and record.kind == SPAWN:\n"
     "            record.columns |= read_orientation(body)\n"),
    ("payload", "bits of groups that are not listed are passed over",
     "require(1 <= groups <= all_groups,", "require(groups & all_groups,"),
    ("payload", "a spawn has its type before reuse",
     "        if record.kind == SPAWN:\n"
     "            record.reuse = body.u8()\n"
     "        if record.kind in (SPAWN, TYPE_CHANGE):\n"
     "            record.type = body.leb128(3)\n",
     "        if record.kind in (SPAWN, TYPE_CHANGE):\n"
     "            record.type = body.leb128(3)\n"
     "        if record.kind == SPAWN:\n"
     "            record.reuse = body.u8()\n"),
    ("payload", "a teleport keeps c",
     "            state.c[:, slot] = 0\n",
     "            state.c[:, slot] = state.c[:, slot] * (record.kind == TELEPORT)\n"),
    ("payload", "a teleport of the orientation alone keeps c",
     "            state.c[:, slot] = 0\n",
     '            state.c[:, slot] = state.c[:, slot] * ("p" not in record.columns)\n'),
    ("payload", "a teleport wakes nobody", "            state.rest[slot] = 0\n", ""),
    ("payload", "a teleport of the orientation alone wakes nobody",
     "            state.rest[slot] = 0\n",
     '            state.rest[slot] = state.rest[slot] and "p" not in record.columns\n'),
    ("payload", "a teleport of the position alone stops the turn",
     "            state.c[:, slot] = 0\n",
     "            state.c[:, slot] = 0\n"
     '            state.w[:, slot] *= "q" in record.columns\n'),
    ("payload", "a teleport counts a new body",
     "            renewed[slot] = 1\n",
     "            renewed[slot] = 1\n"
     "            state.reuse[slot] += record.kind == TELEPORT\n"),
    ("payload", "a teleport keeps the codec's columns",
     "            state.codec[:, slot] = 0\n", "            state.codec[:, slot] *= record.kind == TELEPORT\n"),
    ("payload", "a teleport zeroes the codec's columns of its own groups alone",
     "            state.codec[:, slot] = 0\n",
     '            state.codec[:5, slot] *= "p" not in record.columns\n'
     '            state.codec[5:, slot] *= "q" not in record.columns\n'),
    ("payload", "a body that was teleported is not renewed",
     "            renewed[slot] = 1\n", "            renewed[slot] = record.kind == SPAWN\n"),
    ("payload", "a type change renews",
     "            state.type[slot] = record.type\n",
     "            state.type[slot] = record.type\n"
     "            renewed[slot] = 1\n"
     "            state.codec[:, slot] = 0\n"),
    ("payload", "a type change wakes",
     "            state.type[slot] = record.type\n",
     "            state.type[slot] = record.type\n"
     "            state.rest[slot] = 0\n"),
    ("payload", "a type change sets c = 0",
     "            state.type[slot] = record.type\n",
     "            state.type[slot] = record.type\n"
     "            state.c[:, slot] = 0\n"),
    ("payload", "corrections see the type before the lifecycle",
     "    renewed = apply_records(state, parsed.records, stream.types)\n"
     "    for_p, for_v, for_c = parsed.rounding\n"
     "    state.p[:] = rounded(state.p, for_p)\n"
     '    if stream.codec == "tracker":\n'
     "        tracker.apply_corrections(after, stream, parsed.corrections, renewed, tracker.Setting(for_p, "
     "gravity))\n",
     "    renewed = apply_records(state, parsed.records, stream.types)\n"
     "    for_p, for_v, for_c = parsed.rounding\n"
     "    state.p[:] = rounded(state.p, for_p)\n"
     '    if stream.codec == "tracker":\n'
     "        new, state.type = state.type, np.where(renewed, state.type, world.state.type)\n"
     "        tracker.apply_corrections(after, stream, parsed.corrections, renewed, tracker.Setting(for_p, "
     "gravity))\n"
     "        state.type = new\n"),
    # When and on what the sections act.
    ("payload", "parameters hold from the next delta on",
     "    after.parameters.update(parsed.parameters)\n"
     "    state = after.state\n",
     "    state = after.state\n"
     "    after.parameters = {**world.parameters}\n"),
    ("payload", "corrections come before the records with the thesis's codecs",
     "    renewed = apply_records(state, parsed.records, stream.types)\n",
     '    if stream.codec != "tracker":\n'
     "        codecs.apply_corrections(after, stream, parsed.corrections)\n"
     "        parsed.corrections = []\n"
     "    renewed = apply_records(state, parsed.records, stream.types)\n"),
    ("payload", "0x86 is the first block", "else state.blocks() - 1", "else 0"),
    ("payload", "sections that are not critical are refused",
     'require(kind < 0x80, "critical"', 'require(kind < 0, "critical"'),
    ("payload", "p of bodies at rest is not rounded",
     "    state.p[:] = rounded(state.p, for_p)\n",
     "    state.p[:, state.rest == 0] = rounded(state.p[:, state.rest == 0], for_p)\n"),
    ("payload", "v and c are rounded before the corrections",
     "    state.p[:] = rounded(state.p, for_p)\n",
     "    state.p[:] = rounded(state.p, for_p)\n"
     "    awake = state.rest == 0\n"
     "    state.v[:, awake] = rounded(state.v[:, awake], for_v)\n"
     "    state.c[:, awake] = rounded(state.c[:, awake], for_c)\n"),
    ("payload", "p is rounded once more after the corrections",
     "    awake = state.rest == 0\n",
     "    state.p[:] = rounded(state.p, for_p)\n"
     "    awake = state.rest == 0\n"),
    ("payload", "v and c of bodies at rest are rounded, too",
     "    awake = state.rest == 0\n", "    awake = state.alive\n"),
    ("payload", "v and c of a body that a correction wakes are not rounded",
     "    awake = state.rest == 0\n", "    awake = (state.rest == 0) & (world.state.rest == 0)\n"),
    ("payload", "v and c are rounded by the bits of p",
     "    for_p, for_v, for_c = parsed.rounding\n", "    for_p = for_v = for_c = parsed.rounding[0]\n"),
    ("payload", "the bits of v come behind those of c",
     "    for_p, for_v, for_c = parsed.rounding\n", "    for_p, for_c, for_v = parsed.rounding\n"),
    ("payload", "rounding is down", "((columns + (1 << bits >> 1)) >> bits) << bits", "(columns >> bits) << bits"),
    ("payload", "halves are rounded away from zero",
     "((columns + (1 << bits >> 1)) >> bits) << bits",
     "np.sign(columns) * (((np.abs(columns) + (1 << bits >> 1)) >> bits) << bits)"),
    # The thesis's codecs.
    ("codecs", "the first bit of a mask's byte is the highest", 'bitorder="little")', 'bitorder="big")'),
    ("codecs", "`none` keeps c",
     "state.p[:, slots], state.v[:, slots], state.c[:, slots] = p, v, 0",
     "state.p[:, slots], state.v[:, slots] = p, v"),
    ("codecs", "a correction of the thesis's codecs wakes nobody", "        state.rest[slots] = 0\n", ""),
    ("codecs", "residuals set c = 0",
     "    if state.orientation:\n        state.q[:, slots] = turn.turned(",
     "    state.c[:, slots] = 0\n"
     "    if state.orientation:\n"
     "        state.q[:, slots] = turn.turned("),
    ("codecs", "residuals are unsigned",
     "np.frombuffer(body.take(numbers * bodies), np.int8)", "np.frombuffer(body.take(numbers * bodies), np.uint8)"),
    ("codecs", "residuals of v are in position steps",
     'steps[3:6] * values["velocity_step"]', 'steps[3:6] * values["position_step"]'),
    ("codecs", "sums of positions are not clamped",
     'clamp(state.p[:, slots] + steps[:3] * values["position_step"], MOST_P)',
     'state.p[:, slots] + steps[:3] * values["position_step"]'),
    ("codecs", "sums of velocities are not clamped",
     'clamp(state.v[:, slots] + steps[3:6] * values["velocity_step"], MOST_V)',
     'state.v[:, slots] + steps[3:6] * values["velocity_step"]'),
    ("codecs", "q is turned by the new w",
     'turn.limited(steps[6:9] * values["turn_step"]))\n',
     'turn.limited(steps[6:9] * values["turn_step"] + state.w[:, slots] + steps[9:] * values["spin_step"]))\n'),
    ("codecs", "residuals of w come before those of r",
     'steps[6:9] * values["turn_step"]', 'steps[9:] * values["turn_step"]'),
    ("codecs", "residuals of w are in turn steps",
     'steps[9:] * values["spin_step"]', 'steps[9:] * values["turn_step"]'),
    ("codecs", "only the change of w is limited",
     'turn.limited(state.w[:, slots] + steps[9:] * values["spin_step"])',
     'turn.clamp(state.w[:, slots] + turn.limited(steps[9:] * values["spin_step"]), turn.MOST_W)'),
    ("codecs", "the residuals of r are not limited",
     'turn.limited(steps[6:9] * values["turn_step"])', 'steps[6:9] * values["turn_step"]'),
    ("huffman", "codes of one length are ordered by their signed residual",
     "key=lambda i: (lengths[i], i)", "key=lambda i: (lengths[i], (i + 128) % 256)"),
    ("huffman", "the highest index comes first", "key=lambda i: (lengths[i], i)", "key=lambda i: (lengths[i], -i)"),
    ("huffman", "bits come lowest first", ">> (-self.at & 7) & 1", ">> ((self.at - 1) & 7) & 1"),
    ("huffman", "residual 128 is 128", "index >= 128 else index", "index > 128 else index"),
    ("huffman", "a code is 15 bits long at most", "LONGEST = 18", "LONGEST = 15"),
    ("huffman", "one table serves positions and velocities",
     "return [Table(data[at : at + 256]) for at in range(0, len(data), 256)]",
     "return [Table(data[at & ~511 : (at & ~511) + 256]) for at in range(0, len(data), 256)]"),
    ("huffman", "each body's codes begin with a byte",
     "        result.append(residuals)\n",
     "        result.append(residuals)\n"
     "        bits.at += -bits.at % 8\n"),
    # Integers and parameters.
    ("reader", "values of parameters are not zigzag", "(value >> 1) ^ -(value & 1)", "value"),
    ("reader", "a LEB128 has its highest bits first",
     "value |= (byte & 0x7F) << (7 * i)", "value = value << 7 | byte & 0x7F"),
    ("parameters", "the velocity gain is at most 32768", '("velocity_gain", 0, 65535)', '("velocity_gain", 0, 32768)'),
    ("parameters", "a threshold of 0 is allowed", '("threshold", 1, 2**30)', '("threshold", 0, 2**30)'),
    # Code streams.
    ("range_decoder", "the first bytes are little-endian", 'ljust(4, b"\\0"), "big")', 'ljust(4, b"\\0"), "little")'),
    ("range_decoder", "bytes beyond the end are 255",
     "if self.at < len(self.data) else 0", "if self.at < len(self.data) else 255"),
    ("range_decoder", "a code at the bound is a 1", "one = self.code < bound", "one = self.code <= bound"),
    ("range_decoder", "the range is shifted before the product",
     "bound = (self.range * probability) >> 16", "bound = (self.range >> 16) * probability"),
    ("range_decoder", "the range starts at 2^32", "self.range = 2**32 - 1", "self.range = 2**32"),
    ("range_decoder", "the range has 24 bits at least", "while self.range < 2**24:", "while self.range < 2**23:"),
    ("range_decoder", "the last value of an even number has a slice like all others",
     "self.range = self.range - share * value if value == last else share", "self.range = share"),
    ("range_decoder", "an even number goes beyond its last value",
     "min(self.code // share, last)", "self.code // share"),
    # Snapshots.
    ("number_decoder", "a model has seen nothing at first",
     "self.p, self.seen = 32768, 1", "self.p, self.seen = 32768, 0"),
    ("number_decoder", "a model learns more slowly without end", "min(self.seen + 1, 127)", "self.seen + 1"),
    ("number_decoder", "seen goes up to 128", "min(self.seen + 1, 127)", "min(self.seen + 1, 128)"),
    ("number_decoder", "P falls by a share that is rounded up",
     "self.p - (self.p >> rate)", "self.p - ((self.p + (1 << rate) - 1) >> rate)"),
    ("number_decoder", "numbers of eight bits are long", "SHORT = 8 ", "SHORT = 7 "),
    ("number_decoder", "a long number has its sign first",
     "both & 1, value << high | both >> 1, left - high",
     "both >> high & 1, value << high | both & (1 << high) - 1, left - high"),
    ("number_decoder", "fourteen bits come first", "high = min(left, 15)", "high = min(left, 14)"),
    ("number_decoder", "one bit has models", "while left > 0 and value < 4:", "while left > 0 and value < 2:"),
    ("number_decoder", "all lengths share the sign's model", "models.sign[bits]", "models.sign[0]"),
    ("number_decoder", "the bits of the length share models by their place",
     "models.length[node])", "models.length[node.bit_length()])"),
    ("snapshot", "whether a slot is alive has one model",
     "numbers.decide(living[before])", "numbers.decide(living[0])"),
    ("snapshot", "the slot before the first is alive",
     "living, before = [Model(), Model()], 0\n", "living, before = [Model(), Model()], 1\n"),
    ("snapshot", "bodies at rest are of the same kind", "numbers.number(kinds[rest])", "numbers.number(kinds[0])"),
    ("snapshot", "bodies at rest share the guess",
     "            self.values[rest] = x\n        elif", "            self.values = [x, x]\n        elif"),
    ("snapshot", "v of bodies at rest is guessed as that of others",
     "if self.how == BEFORE or (self.how == HALF and rest):", "if self.how == BEFORE:"),
    ("snapshot", "the guess for v is rounded towards zero",
     "(self.values[rest] + x) >> 1", "int((self.values[rest] + x) / 2)"),
    ("snapshot", "v is guessed as p is", "(self.values[rest] + x) >> 1", "x"),
    ("snapshot", "q and w are guessed as v is",
     "            row[slots] = column(ZERO, -most, most)\n", "            row[slots] = column(HALF, -most, most)\n"),
    ("snapshot", "the guess is of values, not of x",
     "guess.saw(rest, x)\n"
     "        value = x << shift\n",
     "value = x << shift\n"
     "        guess.saw(rest, value)\n"),
    ("snapshot", "column_shift is not applied", "value = x << shift\n", "value = x\n"),
    ("snapshot", "column_shift has four bits", "shift = numbers.even_bits(5)", "shift = numbers.even_bits(4)"),
    ("snapshot", "the kinds of all columns are the same",
     "    kinds = [NumberModels(), NumberModels()]\n",
     "    kinds = numbers.__dict__.setdefault('kinds', [NumberModels(), NumberModels()])\n"),
    ("snapshot", "type comes before reuse",
     "    state.reuse[slots] = column(ZERO, 0, 255)\n"
     "    state.type[slots] = column(ZERO, 0, stream.types - 1)\n",
     "    state.type[slots] = column(ZERO, 0, stream.types - 1)\n"
     "    state.reuse[slots] = column(ZERO, 0, 255)\n"),
    ("snapshot", "w comes before q",
     "((state.q, turn.ONE), (state.w, turn.MOST_W))", "((state.w, turn.MOST_W), (state.q, turn.ONE))"),
    ("snapshot", "reuse is signed",
     "state.reuse[slots] = column(ZERO, 0, 255)", "state.reuse[slots] = column(ZERO, -128, 127)"),
    ("snapshot", "inputs that act on one frame: only the first is kept",
     "        inputs[number] = acts_on, read_drive(body)\n",
     "        drive = read_drive(body)\n"
     "        if acts_on not in [frame for frame, _ in inputs.values()]:\n"
     "            inputs[number] = acts_on, drive\n"),
    ("timeline", "the scheduled inputs of a snapshot are not taken over",
     "cut.last_input, cut.inputs)", "cut.last_input)"),
    ("timeline", "the parameters of a snapshot are not taken over",
     "        return cls(stream, cut.world.copy(), cut.frame,",
     "        cut.world.parameters.update(stream.parameters)\n        return cls(stream, cut.world.copy(), cut.frame,"),
    ("timeline", "the drive of a snapshot is not taken over",
     "cut.frame, cut.drive, cut.last_input", "cut.frame, predict.Drive((0, 0, 0), 0), cut.last_input"),
    ("timeline", "the models of a snapshot are not taken over",
     "        return cls(stream, cut.world.copy(), cut.frame,",
     "        cut.world.models = payload.start_models(stream)\n"
     "        return cls(stream, cut.world.copy(), cut.frame,"),
]  # fmt: skip
