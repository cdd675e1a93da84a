"""Figures, as sdk/include/tandem/*_figures.hpp has them. Written by sdk/package/figures.py."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ClientFigures:
    """The figures of a client since it was made. Times are in milliseconds. Percentiles are over all frames."""

    client_ms_p50: float  #: decode, apply and simulate one frame
    mbit_per_s: float  #: payload rate since the first frame; 1 Mbit = 2^20 bits
    wire_mbit_per_s: float  #: the same of packets with all headers, in both directions, computed
    frames_applied: int  #: deltas that were applied
    resyncs: int  #: rejoins: joins after the first one of an epoch
    hash_mismatches: int  #: frames whose state differed from the server's
    inputs_sent: int  #: whatever their outcome
    inputs_refused: int  #: refused by the server
    refused_messages: int  #: bytes that broke a rule of the protocol
    payload_bytes: int  #: of deltas
    latency_ms_p50: float  #: from publishing to applying; to half a round trip if clocks differ
    latency_ms_p99: float  #: as latency_ms_p50
    input_latency_ms_p50: float  #: from sending to applying the frame that the input acted on
    input_latency_ms_p99: float  #: as input_latency_ms_p50
    client_ms_p99: float  #: as client_ms_p50
    join_ms: float  #: last join: from finding the session, or from losing it, to playing
    round_trip_ms: float  #: to the server and back
    jitter_ms: float  #: mean deviation of the times at which deltas are published
    stream_changes: int  #: changes from one stream of a session to another
    inputs_acted: int  #: acted on a frame that was applied
    inputs_unknown: int  #: the input or its answer was lost
    queue_high_water: int  #: maximum number of deltas that waited at once
