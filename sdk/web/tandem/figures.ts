// Figures, as sdk/include/tandem/*_figures.hpp has them. Written by sdk/package/figures.py.

/** The figures of a client since it was made. Times are in milliseconds. */
export interface ClientFigures {
  /** Decode, apply and simulate one frame. */
  clientMsP50: number;
  /** Payload rate since the first frame; 1 Mbit = 2^20 bits. */
  mbitPerS: number;
  /** The same of packets with all headers, in both directions, computed. */
  wireMbitPerS: number;
  /** Deltas that were applied. */
  framesApplied: number;
  /** Rejoins: joins after the first one of an epoch. */
  resyncs: number;
  /** Frames whose state differed from the server's. */
  hashMismatches: number;
  /** Whatever their outcome. */
  inputsSent: number;
  /** Refused by the server. */
  inputsRefused: number;
  /** Bytes that broke a rule of the protocol. */
  refusedMessages: number;
  /** Of deltas. */
  payloadBytes: number;
  /** From publishing to applying; to half a round trip if clocks differ. */
  latencyMsP50: number;
  /** As latency_ms_p50. */
  latencyMsP99: number;
  /** From sending to applying the frame that the input acted on. */
  inputLatencyMsP50: number;
  /** As input_latency_ms_p50. */
  inputLatencyMsP99: number;
  /** As client_ms_p50. */
  clientMsP99: number;
  /** Last join: from finding the session, or from losing it, to playing. */
  joinMs: number;
  /** To the server and back. */
  roundTripMs: number;
  /** Mean deviation of the times at which deltas are published. */
  jitterMs: number;
  /** Changes from one stream of a session to another. */
  streamChanges: number;
  /** Acted on a frame that was applied. */
  inputsActed: number;
  /** The input or its answer was lost. */
  inputsUnknown: number;
  /** Maximum number of deltas that waited at once. */
  queueHighWater: number;
}

/** The figures of a server. Rates and durations are of the last second. */
export interface ServerFigures {
  /** Size of replies as messages. */
  replyBytes: number;
  /** Size of scheduled inputs as messages. */
  inputBytes: number;
  /** Size of the snapshots, including repetitions. */
  snapshotBytes: number;
  /** Suspensions that a participant caused. */
  stalls: number;
  /** Time that due frames waited for participants or the queue. */
  suspendedMs: number;
  /** Refused by a rule, by the rate limit or by the simulation. */
  refusedInputs: number;
  /** Messages that broke a rule of the protocol. */
  refusedMessages: number;
  /** Snapshots made for joining clients. */
  snapshots: number;
  /** Since the start. */
  uptimeS: number;
  /** As achieved. */
  frameRateHz: number;
  /** Payload rate; 1 Mbit = 2^20 bits. */
  mbitPerS: number;
  /** What one observer takes on the network, computed; 0: not known. */
  wireMbitPerS: number;
  /** Rate of the stream's channels, uncompressed. */
  rawMbitPerS: number;
  /** Step, predict, encode, apply. */
  frameMsP50: number;
  /** As frame_ms_p50. */
  frameMsP99: number;
  /** Bodies that a delta corrects. */
  correctedPerFrame: number;
  /** In force, scene units. */
  threshold: number;
  /** Bodies alive. */
  bodies: number;
  /** Bodies at rest. */
  atRest: number;
  /** Participants that play. */
  participants: number;
  /** Observers that play. */
  observers: number;
  /** Maximum number of frames that a participant may be behind. */
  window: number;
  /** Maximum number of messages that waited at once. */
  queueHighWater: number;
  /** Size of the deltas' payload. */
  deltaBytes: number;
}
