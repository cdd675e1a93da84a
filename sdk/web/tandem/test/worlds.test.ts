// The module steps ordinary and extreme worlds of every predictor to the bits of the native server.

import { describe, expect, test } from 'vitest';

import { Player } from './player';
import { readTrace, worldNames } from './trace';
import { VARIANTS } from './wasm';

describe.each(VARIANTS)('%s', (variant) => {
  test.each(worldNames())('%s', async (name) => {
    const trace = readTrace(name);
    const player = await new Player().start(variant);
    for (const message of trace.messages) player.play(message);
    expect(player.applied.map((each) => [each.frame, each.hash, each.corrected])).toEqual(trace.told.frames);
    expect(player.module.status()).toMatchObject({ phase: 'playing', hashMismatches: 0, resyncs: 0, refusedMessages: 0 });
  });
});
