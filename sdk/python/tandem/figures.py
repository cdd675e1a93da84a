"""Figures, as sdk/include/tandem/*_figures.hpp has them. Written by sdk/package/figures.py."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ClientFigures:
    """Of a client, since it was made. Times in milliseconds, percentiles over all frames."""

    client_ms_p50: float  #: decode, apply and simulate, a frame
    mbit_per_s: float  #: of payload since the first frame; 2^20 bits to the Mbit
    frames_applied: int  #: deltas
    resyncs: int  #: joins after the first one of an epoch
    hash_mismatches: int  #: frames whose state was not the server's
    inputs_sent: int  #: whatever became of them
    inputs_refused: int  #: by the server
    refused_messages: int  #: bytes that broke a rule of the protocol
    payload_bytes: int  #: of deltas
    latency_ms_p50: float  #: publish to applied; needs one clock for both hosts
    latency_ms_p99: float  #: as latency_ms_p50
    input_latency_ms_p50: float  #: sent until the frame it acted on was applied
    input_latency_ms_p99: float  #: as input_latency_ms_p50
    client_ms_p99: float  #: as client_ms_p50
    join_ms: float  #: last join: from knowing the session, or the loss, to playing
    round_trip_ms: float  #: to the server and back
    jitter_ms: float  #: by which deltas come late
    stream_changes: int  #: from one stream of a session to another
    inputs_acted: int  #: on a frame that was applied
    inputs_unknown: int  #: lost on the way, or their answer was
    queue_high_water: int  #: deltas that waited at once, at most
