// Figures, as sdk/include/tandem/*_figures.hpp has them. Written by sdk/package/figures.py.

/** Of a client, since it was made; times in milliseconds. */
export interface ClientFigures {
  /** Decode, apply and simulate, a frame. */
  clientMsP50: number;
  /** Of payload since the first frame; 2^20 bits to the Mbit. */
  mbitPerS: number;
  /** Deltas. */
  framesApplied: number;
  /** Joins after the first one of an epoch. */
  resyncs: number;
  /** Frames whose state was not the server's. */
  hashMismatches: number;
  /** Whatever became of them. */
  inputsSent: number;
  /** By the server. */
  inputsRefused: number;
  /** Bytes that broke a rule of the protocol. */
  refusedMessages: number;
  /** Of deltas. */
  payloadBytes: number;
  /** Publish to applied; needs one clock for both hosts. */
  latencyMsP50: number;
  /** As latency_ms_p50. */
  latencyMsP99: number;
  /** Sent until the frame it acted on was applied. */
  inputLatencyMsP50: number;
  /** As input_latency_ms_p50. */
  inputLatencyMsP99: number;
  /** As client_ms_p50. */
  clientMsP99: number;
  /** Last join: from knowing the session, or the loss, to playing. */
  joinMs: number;
  /** To the server and back. */
  roundTripMs: number;
  /** By which deltas come late. */
  jitterMs: number;
  /** From one stream of a session to another. */
  streamChanges: number;
  /** On a frame that was applied. */
  inputsActed: number;
  /** Lost on the way, or their answer was. */
  inputsUnknown: number;
  /** Deltas that waited at once, at most. */
  queueHighWater: number;
}

/** Of a server; rates and durations of the last second. */
export interface ServerFigures {
  /** Of replies as messages. */
  replyBytes: number;
  /** Of scheduled inputs as messages. */
  inputBytes: number;
  /** Of the snapshots themselves, repetitions too. */
  snapshotBytes: number;
  /** Suspensions that a participant caused. */
  stalls: number;
  /** Waiting past due, for participants or for the queue. */
  suspendedMs: number;
  /** By rule, rate or simulation. */
  refusedInputs: number;
  /** That broke a rule of the protocol. */
  refusedMessages: number;
  /** Made for those who join. */
  snapshots: number;
  /** Since the start. */
  uptimeS: number;
  /** As it is kept. */
  frameRateHz: number;
  /** Of payload; 2^20 bits to the Mbit. */
  mbitPerS: number;
  /** What positions and velocities would need uncompressed. */
  rawMbitPerS: number;
  /** Step, predict, encode, apply. */
  frameMsP50: number;
  /** As frame_ms_p50. */
  frameMsP99: number;
  /** Bodies that a delta corrects. */
  correctedPerFrame: number;
  /** In force, scene units. */
  threshold: number;
  /** Alive. */
  bodies: number;
  /** Of the bodies. */
  atRest: number;
  /** That play. */
  participants: number;
  /** That play. */
  observers: number;
  /** Frames that a participant may be behind. */
  window: number;
  /** Messages that waited at once, at most. */
  queueHighWater: number;
  /** Of the deltas' payload. */
  deltaBytes: number;
}
