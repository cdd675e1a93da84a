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
    ("state", "the state's hash is that of all leaves",
     'return xxh3_64(self.leaves_hash().to_bytes(8, "little"))', "return self.leaves_hash()"),
    ("state", "the leaves of one kind of all blocks come first",
     "leaves = [leaf for block in range(self.blocks()) for leaf in self.leaves(block)]",
     "leaves = [leaf for kind in zip(*(self.leaves(block) for block in range(self.blocks()))) for leaf in kind]"),
    ("state", "a despawn keeps reuse",
     "(self.alive, self.reuse, self.type, self.rest):", "(self.alive, self.type, self.rest):"),
    ("state", "a despawn leaves q = 0, 0, 0, 1",
     "            rows[:, slot] = 0\n",
     "            rows[:, slot] = 0\n"
     "        self.q[3:, slot] = turn.ONE\n"),
    ("payload", "a parameters section may name none",
     '            require(parsed.parameters, "parameters", "a section that names none")\n', ""),
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
     "        tracker.apply_corrections(after, stream, parsed.corrections, renewed, tracker.Setting(for_p, "
     "gravity))\n",
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
     "    for_p, for_v, for_c, for_q, for_w = parsed.rounding\n",
     "    for_p, _, _, for_q, for_w = parsed.rounding\n"
     "    for_v = for_c = for_p\n"),
    ("payload", "the bits of v come behind those of c",
     "    for_p, for_v, for_c, for_q, for_w = parsed.rounding\n",
     "    for_p, for_c, for_v, for_q, for_w = parsed.rounding\n"),
    ("payload", "the bits of w come before those of q",
     "    for_p, for_v, for_c, for_q, for_w = parsed.rounding\n",
     "    for_p, for_v, for_c, for_w, for_q = parsed.rounding\n"),
    ("payload", "the bits of q and w come before those of p",
     "    for_p, for_v, for_c, for_q, for_w = parsed.rounding\n",
     "    for_p, for_v, for_c, for_q, for_w = (\n"
     "        (*parsed.rounding[2:], *parsed.rounding[:2]) if state.orientation else parsed.rounding\n"
     "    )\n"),
    ("payload", "w is rounded by the bits of v", "    for_p, for_v, for_c, for_q, for_w = parsed.rounding\n",
     "    for_p, for_v, for_c, for_q, _ = parsed.rounding\n"
     "    for_w = for_v\n"),
    ("payload", "a rounding has three bytes in any stream", "range(5 if orientation else 3)", "range(3)"),
    ("payload", "a rounding has five bytes in any stream", "range(5 if orientation else 3)", "range(5)"),
    ("payload", "q may be rounded by 24 bits", "require(bits[3] <= 18,", "require(bits[3] <= 24,"),
    ("payload", "q may be rounded by 17 bits", "require(bits[3] <= 18,", "require(bits[3] <= 17,"),
    ("payload", "w may be rounded by 18 bits", "require(bits[3] <= 18,", "require(max(bits[3:]) <= 18,"),
    ("payload", "only p, v and c have the limit of 24 bits", "require(max(bits) <= 24,", "require(max(bits[:3]) <= 24,"),
    ("payload", "q is rounded before the corrections alone",
     "    round_orientations(state, for_q)\n"
     "    if state.orientation:\n",
     "    if state.orientation:\n"),
    ("payload", "q is rounded after the corrections alone",
     "    state.p[:] = rounded(state.p, for_p)\n"
     "    round_orientations(state, for_q)\n",
     "    state.p[:] = rounded(state.p, for_p)\n"),
    ("payload", "q is rounded before the lifecycle",
     "    renewed = apply_records(state, parsed.records, stream.types)\n"
     "    for_p, for_v, for_c, for_q, for_w = parsed.rounding\n"
     "    state.p[:] = rounded(state.p, for_p)\n"
     "    round_orientations(state, for_q)\n",
     "    for_p, for_v, for_c, for_q, for_w = parsed.rounding\n"
     "    round_orientations(state, for_q)\n"
     "    renewed = apply_records(state, parsed.records, stream.types)\n"
     "    state.p[:] = rounded(state.p, for_p)\n"),
    ("payload", "q of bodies at rest is not rounded",
     "        alive = state.alive == 1\n", "        alive = (state.alive == 1) & (state.rest == 0)\n"),
    ("payload", "q of bodies at rest is rounded before the corrections alone",
     "    round_orientations(state, for_q)\n"
     "    if state.orientation:\n",
     "    resting = state.q[:, ~awake]\n"
     "    round_orientations(state, for_q)\n"
     "    state.q[:, ~awake] = resting\n"
     "    if state.orientation:\n"),
    ("payload", "q is negated before it is rounded",
     "        q = rounded_in_range(state.q[:, alive], bits, turn.is_quaternion)\n"
     "        state.q[:, alive] = np.where(q[3] < 0, -q, q)\n",
     "        q = state.q[:, alive]\n"
     "        state.q[:, alive] = rounded_in_range(np.where(q[3] < 0, -q, q), bits, turn.is_quaternion)\n"),
    ("payload", "w of q has its sign from before it was rounded",
     "np.where(q[3] < 0, -q, q)", "np.where(state.q[3, alive] < 0, -q, q)"),
    ("payload", "q is not negated", "np.where(q[3] < 0, -q, q)", "q"),
    ("payload", "q is negated where its w is 0, too", "np.where(q[3] < 0, -q, q)", "np.where(q[3] <= 0, -q, q)"),
    ("payload", "q with a w above 0 is negated", "np.where(q[3] < 0, -q, q)", "np.where(q[3] > 0, -q, q)"),
    ("payload", "w of q alone is negated", "np.where(q[3] < 0, -q, q)", "np.vstack([q[:3], np.abs(q[3:])])"),
    ("payload", "a component of q that is negative decides by its order: x first",
     "np.where(q[3] < 0, -q, q)", "np.where(q[0] < 0, -q, q)"),
    ("payload", "a q that stays as it was is not negated",
     "np.where(q[3] < 0, -q, q)",
     "np.where((q[3] < 0) & turn.is_quaternion(rounded(state.q[:, alive], bits)), -q, q)"),
    ("payload", "q is negated where it is rounded by no bits",
     "    if state.orientation and bits:\n", "    if state.orientation:\n"),
    ("payload", "q is rounded where it leaves its range",
     "q = rounded_in_range(state.q[:, alive], bits, turn.is_quaternion)", "q = rounded(state.q[:, alive], bits)"),
    ("payload", "q that would leave its range is rounded down",
     "    return np.where(is_in_range(result), result, vectors)\n",
     "    return np.where(is_in_range(result), result, vectors if len(vectors) == 3 else vectors >> bits << bits)\n"),
    ("payload", "w is rounded where it leaves its range",
     "state.w[:, awake] = rounded_in_range(state.w[:, awake], for_w, turn.is_spin)",
     "state.w[:, awake] = rounded(state.w[:, awake], for_w)"),
    ("payload", "w that would leave its range is halved",
     "state.w[:, awake] = rounded_in_range(state.w[:, awake], for_w, turn.is_spin)",
     "state.w[:, awake] = turn.limited(rounded(state.w[:, awake], for_w))"),
    ("payload", "only an axis of w beyond 2 rad stays",
     "state.w[:, awake] = rounded_in_range(state.w[:, awake], for_w, turn.is_spin)",
     "state.w[:, awake] = rounded_in_range(state.w[:, awake], for_w, lambda w: np.abs(w) <= turn.MOST_W)"),
    ("payload", "w and q are rounded down",
     "    result = rounded(vectors, bits)\n", "    result = vectors >> bits << bits\n"),
    ("payload", "halves of q and w are rounded away from zero",
     "    result = rounded(vectors, bits)\n", "    result = np.sign(vectors) * rounded(np.abs(vectors), bits)\n"),
    ("payload", "halves of w are rounded away from zero",
     "    result = rounded(vectors, bits)\n",
     "    result = rounded(vectors, bits)\n"
     "    if len(vectors) == 3:\n"
     "        result = np.sign(vectors) * rounded(np.abs(vectors), bits)\n"),
    ("payload", "w of bodies at rest is rounded, too",
     "state.w[:, awake] = rounded_in_range(state.w[:, awake], for_w, turn.is_spin)",
     "state.w[:] = rounded_in_range(state.w, for_w, turn.is_spin)"),
    ("payload", "w of a body that a correction wakes is not rounded",
     "    if state.orientation:\n"
     "        state.w[:, awake]",
     "    awake &= world.state.rest == 0\n"
     "    if state.orientation:\n"
     "        state.w[:, awake]"),
    ("payload", "w is rounded before the corrections, too",
     "    state.p[:] = rounded(state.p, for_p)\n",
     "    state.p[:] = rounded(state.p, for_p)\n"
     "    awake = state.rest == 0\n"
     "    state.w[:, awake] = rounded_in_range(state.w[:, awake], for_w, turn.is_spin)\n"),
    ("payload", "w is rounded before the corrections alone",
     "    if state.orientation:\n"
     "        state.w[:, awake] = rounded_in_range(state.w[:, awake], for_w, turn.is_spin)\n"
     "    return after\n",
     "    return after\n"),
    ("payload", "w is not rounded",
     "state.w[:, awake] = rounded_in_range(state.w[:, awake], for_w, turn.is_spin)", "pass"),
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
     "    if state.orientation:\n        state.q[:, slots], _ = turn.turned_by(",
     "    state.c[:, slots] = 0\n"
     "    if state.orientation:\n"
     "        state.q[:, slots], _ = turn.turned_by("),
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
     'steps[6:9] * values["turn_step"])\n',
     'steps[6:9] * values["turn_step"] + state.w[:, slots] + steps[9:] * values["spin_step"])\n'),
    ("codecs", "residuals of w come before those of r",
     'steps[6:9] * values["turn_step"]', 'steps[9:] * values["turn_step"]'),
    ("codecs", "residuals of w are in turn steps",
     'steps[9:] * values["spin_step"]', 'steps[9:] * values["turn_step"]'),
    ("codecs", "only the change of w is limited",
     'turn.limited(state.w[:, slots] + steps[9:] * values["spin_step"])',
     'turn.clamp(state.w[:, slots] + turn.limited(steps[9:] * values["spin_step"]), turn.MOST_W)'),
    ("codecs", "residuals of r turn once",
     'state.q[:, slots], _ = turn.turned_by(state.q[:, slots], steps[6:9] * values["turn_step"])',
     'state.q[:, slots] = turn.turned(state.q[:, slots], turn.limited(steps[6:9] * values["turn_step"]))'),
    ("codecs", "residuals of w are passed over where those of r are far",
     '        state.q[:, slots], _ = turn.turned_by(state.q[:, slots], steps[6:9] * values["turn_step"])\n',
     '        state.q[:, slots], far = turn.turned_by(state.q[:, slots], steps[6:9] * values["turn_step"])\n'
     "        steps[9:, far] = 0\n"),
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
    ("range_decoder", "a model has seen nothing at first",
     "self.p, self.seen = 32768, 1", "self.p, self.seen = 32768, 0"),
    ("range_decoder", "a model learns more slowly without end", "min(self.seen + 1, 127)", "self.seen + 1"),
    ("range_decoder", "seen goes up to 128", "min(self.seen + 1, 127)", "min(self.seen + 1, 128)"),
    ("range_decoder", "P falls by a share that is rounded up",
     "self.p - (self.p >> rate)", "self.p - ((self.p + (1 << rate) - 1) >> rate)"),
    ("range_decoder", "numbers of eight bits are long", "SHORT = 8 ", "SHORT = 7 "),
    ("range_decoder", "a long number has its sign first",
     "both & 1, value << high | both >> 1, left - high",
     "both >> high & 1, value << high | both & (1 << high) - 1, left - high"),
    ("range_decoder", "fourteen bits come first", "high = min(left, 15)", "high = min(left, 14)"),
    ("range_decoder", "one bit has models", "while left > 0 and value < 4:", "while left > 0 and value < 2:"),
    ("range_decoder", "all lengths share the sign's model", "models.sign[bits]", "models.sign[0]"),
    ("range_decoder", "the bits of the length share models by their place",
     "models.length[node])", "models.length[node.bit_length()])"),
    ("snapshot", "whether a slot is alive has one model",
     "numbers.decide(living[before])", "numbers.decide(living[0])"),
    ("snapshot", "the slot before the first is alive",
     "living, before = [Model(), Model()], 0\n", "living, before = [Model(), Model()], 1\n"),
    ("snapshot", "bodies at rest are of the same kind",
     "x = guess.values[rest] + numbers.number(kinds[rest])", "x = guess.values[rest] + numbers.number(kinds[0])"),
    ("snapshot", "bodies at rest share the guess",
     "            self.values[rest] = x\n        elif", "            self.values = [x, x]\n        elif"),
    ("snapshot", "v of bodies at rest is guessed as that of others",
     "if self.how == BEFORE or (self.how != ZERO and rest):", "if self.how == BEFORE or (self.how == REST and rest):"),
    ("snapshot", "the guess for v is rounded towards zero",
     "(self.values[rest] + x) >> 1", "int((self.values[rest] + x) / 2)"),
    ("snapshot", "v is guessed as p is", "(self.values[rest] + x) >> 1", "x"),
    ("snapshot", "q is guessed as v is", "column(REST, -turn.ONE, turn.ONE)", "column(HALF, -turn.ONE, turn.ONE)"),
    ("snapshot", "q is guessed as p is", "column(REST, -turn.ONE, turn.ONE)", "column(BEFORE, -turn.ONE, turn.ONE)"),
    ("snapshot", "q of bodies at rest is guessed as 0",
     "column(REST, -turn.ONE, turn.ONE)", "column(ZERO, -turn.ONE, turn.ONE)"),
    ("snapshot", "q of bodies at rest is guessed as that of the body before, at rest or not",
     "            self.values[rest] = x\n        elif",
     "            self.values[rest] = x\n"
     "        elif self.how == REST:\n"
     "            self.values[1] = x\n"
     "        elif"),
    ("snapshot", "w of bodies at rest is guessed as q is",
     "column(ZERO, -turn.MOST_W, turn.MOST_W)", "column(REST, -turn.MOST_W, turn.MOST_W)"),
    ("snapshot", "w is guessed as v is",
     "column(ZERO, -turn.MOST_W, turn.MOST_W)", "column(HALF, -turn.MOST_W, turn.MOST_W)"),
    ("snapshot", "w of q is guessed as x, y and z are",
     "read_norm(numbers, at_rest, state.q[:3, slots], turn.ONE)", "column(REST, -turn.ONE, turn.ONE)"),
    ("snapshot", "w of q is guessed as 0",
     "math.isqrt(max(0, 2**60 - sum(x * x for x in vector))) >> shift", "0"),
    ("snapshot", "w of q is guessed as negative",
     "math.isqrt(max(0, 2**60 - sum(x * x for x in vector))) >> shift",
     "-(math.isqrt(max(0, 2**60 - sum(x * x for x in vector))) >> shift)"),
    ("snapshot", "w of q is guessed as root() rounded to the nearest",
     "math.isqrt(max(0, 2**60 - sum(x * x for x in vector))) >> shift",
     "round(math.sqrt(max(0, 2**60 - sum(x * x for x in vector)))) >> shift"),
    ("snapshot", "the guess for w of q is not shifted",
     "math.isqrt(max(0, 2**60 - sum(x * x for x in vector))) >> shift",
     "math.isqrt(max(0, 2**60 - sum(x * x for x in vector)))"),
    ("snapshot", "the shift of the guess for w of q is rounded",
     "math.isqrt(max(0, 2**60 - sum(x * x for x in vector))) >> shift",
     "(math.isqrt(max(0, 2**60 - sum(x * x for x in vector))) + (1 << shift >> 1)) >> shift"),
    ("snapshot", "what is left of the norm has no least value",
     "math.isqrt(max(0, 2**60 - sum(x * x for x in vector))) >> shift",
     "math.isqrt(abs(2**60 - sum(x * x for x in vector))) >> shift"),
    ("snapshot", "the squares of the norm are shifted as everywhere else",
     "math.isqrt(max(0, 2**60 - sum(x * x for x in vector))) >> shift",
     "2 * math.isqrt(max(0, 2**58 - sum(x * x >> 2 for x in vector))) >> shift"),
    ("snapshot", "w of q is guessed from the body before",
     "read_norm(numbers, at_rest, state.q[:3, slots], turn.ONE)",
     "read_norm(numbers, at_rest, np.roll(state.q[:3, slots], 1, axis=1), turn.ONE)"),
    ("snapshot", "w of q of bodies at rest is guessed as the one before",
     "        value = (guess + numbers.number(kinds[rest])) << shift\n",
     "        if rest and values and at_rest[len(values) - 1]:\n"
     "            guess = values[-1] >> shift\n"
     "        value = (guess + numbers.number(kinds[rest])) << shift\n"),
    ("snapshot", "w of q of bodies at rest is of the same kind",
     "(guess + numbers.number(kinds[rest]))", "(guess + numbers.number(kinds[0]))"),
    ("snapshot", "w of q is not negative", "require(-most <= value <= most,", "require(0 <= value <= most,"),
    ("snapshot", "w of q comes before x, y and z",
     "        for axis in range(3):\n"
     "            state.q[axis, slots] = column(REST, -turn.ONE, turn.ONE)\n"
     "        state.q[3, slots] = read_norm(numbers, at_rest, state.q[:3, slots], turn.ONE)\n",
     "        state.q[3, slots] = read_norm(numbers, at_rest, state.q[:3, slots], turn.ONE)\n"
     "        for axis in range(3):\n"
     "            state.q[axis, slots] = column(REST, -turn.ONE, turn.ONE)\n"),
    ("snapshot", "a snapshot of format version 2 is accepted", "require(version == 3,", "require(version in (2, 3),"),
    # The exchange of 0 and the value before.
    ("snapshot", "ages and intervals do not change places with 0",
     "        x = {0: before[rest], before[rest]: 0}.get(x, x)\n", ""),
    ("snapshot", "only a 0 stands for the value before",
     "{0: before[rest], before[rest]: 0}.get(x, x)", "before[rest] if x == 0 else x"),
    ("snapshot", "ages and intervals are the value before and a number",
     "{0: before[rest], before[rest]: 0}.get(x, x)", "before[rest] + x"),
    ("snapshot", "the value before is that of either kind",
     "        before[rest] = x\n", "        before = [x, x]\n"),
    ("snapshot", "the value before is the last one that was not 0",
     "        before[rest] = x\n", "        before[rest] = x or before[rest]\n"),
    ("snapshot", "the value before is the last number, not what it stands for",
     "        x = {0: before[rest], before[rest]: 0}.get(x, x)\n        before[rest] = x\n",
     "        number = x\n        x = {0: before[rest], before[rest]: 0}.get(x, x)\n        before[rest] = number\n"),
    ("snapshot", "ages and intervals of bodies at rest are of the same kind",
     "        x = numbers.number(kinds[rest])\n", "        x = numbers.number(kinds[0])\n"),
    ("snapshot", "ages alone change places",
     "if i % tracker.GROUP in (tracker.AGE, tracker.INTERVAL):", "if i % tracker.GROUP == tracker.AGE:"),
    ("snapshot", "intervals alone change places",
     "if i % tracker.GROUP in (tracker.AGE, tracker.INTERVAL):", "if i % tracker.GROUP == tracker.INTERVAL:"),
    ("snapshot", "only the position's ages and intervals change places",
     "if i % tracker.GROUP in (tracker.AGE, tracker.INTERVAL):", "if i in (tracker.AGE, tracker.INTERVAL):"),
    ("snapshot", "last steps change places, too",
     "if i % tracker.GROUP in (tracker.AGE, tracker.INTERVAL):\n"
     "            row[slots] = np.array(read_same(numbers, at_rest), np.int64) % 256\n",
     "if True:\n"
     "            row[slots] = np.array(read_same(numbers, at_rest), np.int64)\n"
     "            if i % tracker.GROUP in (tracker.AGE, tracker.INTERVAL):\n"
     "                row %= 256\n"),
    ("snapshot", "what changes places is the value, not x",
     "        before[rest] = x\n", "        before[rest] = x << shift\n"),
    ("snapshot", "the guess is of values, not of x",
     "guess.saw(rest, x)\n"
     "        value = x << shift\n",
     "value = x << shift\n"
     "        guess.saw(rest, value)\n"),
    ("snapshot", "column_shift is not applied", "value = x << shift\n", "value = x\n"),
    ("snapshot", "column_shift has four bits",
     "    shift = numbers.even_bits(5)\n    kinds = [NumberModels(), NumberModels()]\n    values = []\n    for rest in at_rest:\n"
     "        x = guess",
     "    shift = numbers.even_bits(4)\n    kinds = [NumberModels(), NumberModels()]\n    values = []\n    for rest in at_rest:\n"
     "        x = guess"),
    ("snapshot", "the kinds of all columns are the same",
     "    kinds = [NumberModels(), NumberModels()]\n    values = []\n    for rest in at_rest:\n        x = guess",
     "    kinds = numbers.__dict__.setdefault('kinds', [NumberModels(), NumberModels()])\n"
     "    values = []\n    for rest in at_rest:\n        x = guess"),
    ("snapshot", "the column w of q has no column_shift",
     "    shift = numbers.even_bits(5)\n    kinds = [NumberModels(), NumberModels()]\n    values = []\n    for rest, vector",
     "    shift = 0\n    kinds = [NumberModels(), NumberModels()]\n    values = []\n    for rest, vector"),
    ("snapshot", "the columns age and interval have no column_shift",
     "    shift = numbers.even_bits(5)\n    kinds, before", "    shift = 0\n    kinds, before"),
    ("snapshot", "type comes before reuse",
     "    state.reuse[slots] = column(ZERO, 0, 255)\n"
     "    state.type[slots] = column(ZERO, 0, stream.types - 1)\n",
     "    state.type[slots] = column(ZERO, 0, stream.types - 1)\n"
     "    state.reuse[slots] = column(ZERO, 0, 255)\n"),
    ("snapshot", "w comes before q",
     "    if stream.orientation:\n",
     "    if stream.orientation:\n"
     "        for axis in range(3):\n"
     "            state.w[axis, slots] = column(ZERO, -turn.MOST_W, turn.MOST_W)\n"
     "        for axis in range(3):\n"
     "            state.q[axis, slots] = column(REST, -turn.ONE, turn.ONE)\n"
     "        state.q[3, slots] = read_norm(numbers, at_rest, state.q[:3, slots], turn.ONE)\n"
     "    if False:\n"),
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
