#ifndef TANDEM_TANDEM_H
#define TANDEM_TANDEM_H

#include <stddef.h>
#include <stdint.h>

/**
 * @file
 * Tandem follows a physical simulation that runs on a server. A client holds every body exactly as the server
 * agreed on it, bit by bit; it draws the bodies and acts on them. This header is the manual of the client
 * SDK; every other language uses it.
 *
 *     tandem_client client;
 *     tandem_join(NULL, &client);                      // session "default" on DDS domain 0
 *     tandem_wait_until_playing(client, 10);
 *     tandem_send_gravity(client, (const double[3]){3, -9, 0}, NULL);
 *     tandem_columns columns = TANDEM_COLUMNS_INIT;    // into your own array of structs
 *     columns.capacity = MOST_BODIES;
 *     columns.positions = bodies[0].position;
 *     columns.position_stride = sizeof bodies[0];
 *     tandem_sample(client, NULL, &columns, NULL);     // at any rate
 *     tandem_leave(client);
 *
 * Handles   A client or browser is a number that is never used twice in a process; 0 is none. A call with a
 *           handle that is closed or was never made returns TANDEM_INVALID_HANDLE, also while another thread
 *           closes it. Close all handles before main() returns.
 * Results   Functions return TANDEM_OK (0) or what went wrong. tandem_error_text() describes the last failure
 *           in the calling thread. A call that fails leaves its outputs as they were, unless its text says
 *           otherwise. No C++ exception leaves a function. Every function may return
 *           TANDEM_INVALID_ARGUMENT (a null pointer where the text does not allow it, a size or number out
 *           of range), TANDEM_INVALID_HANDLE, TANDEM_IN_CALLBACK, TANDEM_OUT_OF_MEMORY and TANDEM_INTERNAL;
 *           the texts name the others.
 * Structs   Each struct begins with `size`. Set it with the struct's ..._INIT; no function changes it. In an
 *           array of structs the size of the first counts for all. A program built with an older header runs
 *           with a newer library. A program built with a newer header runs with an older library if it
 *           leaves zero what that library does not know (otherwise: TANDEM_UNSUPPORTED); outputs that the
 *           library does not know are zero.
 * Threads   All functions may be called from any thread, unless they say otherwise. tandem_sample() never
 *           waits for the network, for decoding or for applying. The others may wait until the current frame
 *           is applied. A callback may call only tandem_error_text(), tandem_result_text(),
 *           tandem_clock_ns() and the version's functions; all others return TANDEM_IN_CALLBACK.
 * Memory    The caller owns arrays and structs; the library keeps no pointer to them after the call. Texts in
 *           structs end with 0 and are cut if they are too long. Buffers are bounded, even if a client is
 *           seldom updated.
 * Processes The clients of one process and domain share the DDS domain: its sockets, threads and discovery.
 *           Each client has its own participant and endpoints. After fork() the child has none of its
 *           parent's clients, and it cannot join (TANDEM_TRANSPORT) before it has called exec().
 * Units     Scene units (usually metres), seconds, radians; right-handed as the scene. Frames begin at 1.
 *
 * Everything that is not marked EXPERIMENTAL keeps its meaning and binary form until the next major version.
 */

/* Define TANDEM_API before the include if the static library is linked or the symbols are wrapped. */
#ifndef TANDEM_API
#define TANDEM_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
#define TANDEM_NOEXCEPT noexcept
extern "C" {
#else
#define TANDEM_NOEXCEPT
#endif

/** @name Version
 * The API follows semantic versioning. Its version is written down only here.
 * @{ */
#define TANDEM_VERSION_MAJOR 0 /**< a new major version may break programs */
#define TANDEM_VERSION_MINOR 1 /**< a new minor version adds to the API */
#define TANDEM_VERSION_PATCH 0 /**< a new patch version repairs faults */
/** The version of this header, to compare with tandem_version_number(). */
#define TANDEM_VERSION_NUMBER \
  (TANDEM_VERSION_MAJOR * 10000 + TANDEM_VERSION_MINOR * 100 + TANDEM_VERSION_PATCH)

/** Returns the version of the loaded library, "MAJOR.MINOR.PATCH". The text stays valid for ever. */
TANDEM_API const char* tandem_version(void) TANDEM_NOEXCEPT;
/** Returns the version of the loaded library in the form of TANDEM_VERSION_NUMBER. */
TANDEM_API uint32_t tandem_version_number(void) TANDEM_NOEXCEPT;
/** @} */

/** @name Results
 * @{ */
/** The result of a call: one of the constants below. Their values never change; new ones are appended. */
typedef int32_t tandem_result;
/** Values of tandem_result; see "Results" above for those that every function may return. */
enum {
  TANDEM_OK = 0,
  TANDEM_INVALID_ARGUMENT = 1, /**< the caller passed something out of range */
  TANDEM_MALFORMED = 2,        /**< received bytes do not parse, or break a rule of the format */
  TANDEM_UNSUPPORTED = 3,      /**< a version or a value that this library does not know */
  TANDEM_MISMATCH = 4,         /**< applied, but the state hash differs from the sender's */
  TANDEM_OUT_OF_ORDER = 5,     /**< not possible in this role or at this moment */
  TANDEM_CAPACITY = 6,         /**< an array is too short, or a limit would be exceeded */
  TANDEM_TIMEOUT = 7,          /**< it did not happen in time */
  TANDEM_CONFLICT = 8,         /**< somebody else owns the name */
  TANDEM_TRANSPORT = 9,        /**< DDS reported an error */
  TANDEM_IO = 10,              /**< a file could not be read or written */
  TANDEM_INVALID_HANDLE = 11,  /**< closed, never made, or of another kind */
  TANDEM_NOT_READY = 12,       /**< not yet: nothing to draw, not playing, not known, or no event */
  TANDEM_IN_CALLBACK = 13,     /**< called from a callback */
  TANDEM_WRONG_THREAD = 14,    /**< another thread does this already */
  TANDEM_OUT_OF_MEMORY = 15,
  TANDEM_INTERNAL = 16 /**< a fault of this library: please report its error text */
};

/** Returns the name of a result, such as "TANDEM_TIMEOUT": never null, and valid for ever. */
TANDEM_API const char* tandem_result_text(tandem_result result) TANDEM_NOEXCEPT;
/** Describes this thread's last failed call in one line of at most 511 bytes. The line is empty before the
 * first failure. It is valid until the next call of this thread fails. */
TANDEM_API const char* tandem_error_text(void) TANDEM_NOEXCEPT;
/** @} */

/** @name Joining
 * @{ */
/** A client of one session. */
typedef uint64_t tandem_client;

/** The role of a client in a session: one of the constants below. */
typedef int32_t tandem_role;
/** Values of tandem_role. */
enum {
  TANDEM_OBSERVER = 0,   /**< only watches; the server never waits for it */
  TANDEM_PARTICIPANT = 1 /**< may send input; within limits the server waits for it */
};

/** What a client is doing: one of the constants below. */
typedef int32_t tandem_phase;
/** Values of tandem_phase. */
enum {
  TANDEM_SEARCHING = 0, /**< has not seen a live server of that session */
  TANDEM_REFUSED = 1,   /**< cannot play the session that is there; tandem_status::reason says why */
  TANDEM_JOINING = 2,   /**< waiting for a snapshot */
  TANDEM_PLAYING = 3    /**< holds the agreed state and follows it */
};

/** The level of a line of the log: one of the constants below. */
typedef int32_t tandem_log_level;
/** Values of tandem_log_level. */
enum { TANDEM_LOG_INFO = 0, TANDEM_LOG_WARNING = 1, TANDEM_LOG_ERROR = 2 };

/** Receives one line for a human, without a line end. The line is valid during the call. The function is
 * called by the thread that does the client's work, while the client is locked: it must return soon, throw
 * nothing, and not wait for a thread that may be in a call with this client. */
typedef void (*tandem_log)(void* user, tandem_log_level level, const char* line);

/** Options of tandem_join(). */
typedef struct tandem_options {
  uint32_t size;
  uint32_t domain;     /**< DDS domain, 0..230 */
  const char* session; /**< 1..64 characters of [A-Za-z0-9._-]; null: "default", or with `url` the gateway's */
  tandem_role role;
  uint32_t lead; /**< frames to simulate beyond the last delta, 0 or 1; clamped to what the session allows */
  /** 1: the client has a thread that does its work. 0: the application calls tandem_update() at least once a
   * frame, and all work is done in that call; the only threads are those of Cyclone DDS. */
  uint32_t background;
  /** EXPERIMENTAL. 1: tandem_sample() shows the gravity that this application sent at once, before the server
   * has said on which frame it acts. */
  uint32_t echo;
  tandem_log log; /**< may be null */
  void* user;     /**< handed to `log` */
  /** Which of the session's streams to play: "auto" (the fewest bits, if that costs this processor little),
   * "bandwidth" (the fewest bits), "computing" (the least computing), "error" (the smallest error), or a
   * stream's name. While it plays, the client changes to another stream if processor or link cannot follow,
   * or if another stream suits the preference better, but never leaves one that was named. Null: "auto". */
  const char* prefer;
  /** The kind of network, "NAME" or "NAME:key=value,...": "loopback", "lan", "wifi", "wan:server=ADDRESS" or
   * "multihomed:interface=NAME,interface=NAME" (deploy/dds says more). All clients and browsers of a process
   * on a domain have the same. With one, CYCLONEDDS_URI is not used. Null or "": Tandem's defaults and then
   * CYCLONEDDS_URI. */
  const char* profile;
  /** DDS Security: the folder of this program's identity, which `tandem pki issue` made. Null or empty: none. With
   * an observer's identity a client can only join as an observer. */
  const char* secure;
  /** Join over a gateway instead of DDS: "wss://HOST[:PORT]/" or "ws://...", over the Internet, NAT and proxies. It is
   * the address of the viewer's page, which may begin with https or http. Null: DDS. A gateway has one session, so a
   * null `session` takes any; `domain`, `profile` and `secure` are not used. The connection is made in the background
   * by a thread of its own, and again whenever it ends. */
  const char* url;
  const char* token;  /**< for a gateway that asks for one. Null or "": what stands behind '#' in `url` */
  const char* tls_ca; /**< PEM file that a gateway's certificate is checked by. Null or "": the system's */
  /** Threads that share the work on many bodies, 1..64, the calling one among them: applying frames and
   * tandem_sample(). 0: 1. Fewer than 16,384 bodies are worked on by one. Results are the same to the bit. The other
   * threads live as long as the client, and sleep between frames. If tandem_sample() is called while they apply a
   * frame, or the other way round, the later one works alone. */
  uint32_t threads;
  uint32_t reserved; /**< 0 */
  /** How long a frame may be held back until the next ones come, so that they share a message, which costs fewer bytes;
   * seconds, 0..1. What is drawn is that much later. A frame on which an input of this client acted is not held back.
   * A gateway does so for each client, and rounds down to a multiple of 0.05. Over DDS a server offers a stream in one
   * or two delays: the greatest that is not above this is played, or else the shortest. 0: 0.2 as an observer, none as
   * a participant. Less than 0.0005, but not 0: none. */
  double max_delay_s;
  /** What this client may take on the network, with all headers, in both directions; kbit/s (1,000 bit), 16..10,000,000.
   * 0: no cap. Over DDS the client plays, of the streams that are within it, the one with the smallest error: those
   * whose own cap is at most this, and others as long as the server says that they take no more. With `url` the gateway
   * sees to it. Where nothing is within it, or no longer, the client is refused, or the gateway ends the connection;
   * tandem_status::reason names both numbers. Snapshots come at the pace that it leaves. */
  uint32_t max_kbit_s;
  uint32_t reserved_too; /**< 0 */
} tandem_options;
/** The defaults. */
#define TANDEM_OPTIONS_INIT \
  { sizeof(tandem_options), 0, NULL, TANDEM_PARTICIPANT, 1, 1, 0, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, 1, 0, 0, 0, 0 }

/** Starts looking for a session. Returns at once, even if there is no server.
 * @param options  null: the defaults
 * @param client   the new client, to be closed by tandem_leave()
 * @return also TANDEM_TRANSPORT (DDS could not start; an interface of the profile is not there),
 * TANDEM_IO (a file in `secure`; if one is not good, TANDEM_INVALID_ARGUMENT and a text with file and cure; `tls_ca`) and
 * TANDEM_UNSUPPORTED (this library was built without DDS, or without libwebsockets for `url`) */
TANDEM_API tandem_result tandem_join(const tandem_options* options, tandem_client* client) TANDEM_NOEXCEPT;

/** Leaves the session and frees everything that the client holds. Waits for calls of other threads with this
 * client; tandem_update() and tandem_wait_until_playing() then end soon and return TANDEM_INVALID_HANDLE.
 *
 * When the last client of a process leaves, Cyclone DDS stops too. Version 0.10 then waits for a packet that
 * it sends to itself: if the network interface is gone, this call does not return. An application that must
 * not wait can end its process without this call. Or it can set Internal/MultipleReceiveThreads to false in
 * CYCLONEDDS_URI; DDS then needs no packet to stop. */
TANDEM_API tandem_result tandem_leave(tandem_client client) TANDEM_NOEXCEPT;

/** Updates a client that has no thread: takes what arrived, follows the session, and waits for more to do.
 * @param wait_s  maximum wait, seconds; 0 or less: no wait
 * @return also TANDEM_WRONG_THREAD (the client has its own thread, or another thread is in this call) */
TANDEM_API tandem_result tandem_update(tandem_client client, double wait_s) TANDEM_NOEXCEPT;

/** Blocks until the client plays. Updates the client if it has no thread.
 * @param timeout_s  seconds
 * @return also TANDEM_TIMEOUT; without a thread also what tandem_update() returns */
TANDEM_API tandem_result tandem_wait_until_playing(tandem_client client, double timeout_s) TANDEM_NOEXCEPT;

/** Changes tandem_options::prefer, for example when a device saves its battery or a link is metered. If the
 * new preference needs another stream, the client changes to it while it plays. */
TANDEM_API tandem_result tandem_prefer(tandem_client client, const char* prefer) TANDEM_NOEXCEPT;

/** State of a client, and its figures since tandem_join(). Times are in ms, percentiles over all frames. */
typedef struct tandem_status {
  uint32_t size;
  tandem_phase phase;
  tandem_role role;          /**< as granted by the server */
  uint32_t lead;             /**< in force; lower than requested if the session allows less */
  uint32_t server_alive;     /**< 1 or 0 */
  uint32_t queue_high_water; /**< maximum number of deltas that waited at once */
  uint64_t client_id;        /**< random; another one once the client had to join from another network address */
  uint64_t epoch;            /**< one run of a server; 0 before the first */
  uint64_t frame;            /**< last frame agreed with the server */
  uint64_t state_hash;       /**< of that frame */
  uint64_t frames_applied;
  uint64_t resyncs; /**< rejoins: joins after the first one of an epoch */
  uint64_t hash_mismatches;
  uint64_t refused_messages; /**< bytes that broke a rule of the protocol */
  uint64_t payload_bytes;    /**< of deltas */
  uint64_t inputs_sent;
  uint64_t inputs_acted;
  uint64_t inputs_refused;
  uint64_t inputs_unknown; /**< the input or its answer was lost */
  uint64_t events_dropped; /**< events dropped before tandem_next_event() took them */
  double frame_rate_hz;
  double mbit_per_s;     /**< payload rate since the first frame; 1 Mbit = 2^20 bits */
  double latency_ms_p50; /**< from publishing to applying; to half a round trip if clocks differ */
  double latency_ms_p99;
  double input_latency_ms_p50; /**< from sending to applying the frame that the input acted on */
  double input_latency_ms_p99;
  double client_ms_p50; /**< decode, apply and simulate one frame */
  double client_ms_p99;
  double join_ms; /**< duration of the last join: from finding the session, or from losing it, to playing */
  double round_trip_ms;
  double jitter_ms;
  char scene[72];
  char reason[256];        /**< why role or phase is not as requested; empty if it is */
  char stream[40];         /**< name of the stream that is played or joined; its number if it has no name */
  char stream_reason[152]; /**< why this stream was chosen, for a human */
  uint64_t stream_changes; /**< changes from one stream of a session to another */
  double wire_mbit_per_s;  /**< as mbit_per_s, of packets with all headers, in both directions, computed */
} tandem_status;
/** An empty one, to be filled in. */
#define TANDEM_STATUS_INIT                                                                                  \
  {                                                                                                         \
    sizeof(tandem_status), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, \
        0, 0, 0, {0}, {0}, {0}, {0}, 0, 0                                                                   \
  }

/** Fills in the client's state and figures. */
TANDEM_API tandem_result tandem_get_status(tandem_client client, tandem_status* status) TANDEM_NOEXCEPT;
/** @} */

/** @name Drawing
 * @{ */
/** The moment that is drawn: one of the constants below. */
typedef int32_t tandem_sample_mode;
/** Values of tandem_sample_mode. */
enum {
  TANDEM_INTERPOLATE = 0, /**< between the last two agreed frames: exact, but one frame late */
  /** At the server's time: predicted; corrections are blended in by an offset that decays. If nothing comes
   * from the server, the bodies move on for a moment, slow down and stop
   * (tandem_frame::seconds_since_delta). */
  TANDEM_EXTRAPOLATE = 1
};

/** What a body did since the client's previous sample: one of the constants below. */
enum {
  TANDEM_CHANGE_NONE = 0,
  TANDEM_CHANGE_NEW = 1,   /**< the body was not there before, or another body took its slot */
  TANDEM_CHANGE_GONE = 2,  /**< the body was there in the previous sample */
  TANDEM_CHANGE_JUMPED = 3 /**< the same body at another place: it was teleported, or the client rejoined */
};

/** Options of tandem_sample(). */
typedef struct tandem_sample_options {
  uint32_t size;
  tandem_sample_mode mode;
  /** The moment to draw, by tandem_clock_ns(), for example when the picture will be on the screen; 0: now. A
   * moment far in the past or future gives the nearest one that is held; tandem_frame::frame says which. */
  int64_t at_ns;
  /** Time constant of the offset that blends in corrections, seconds, at most 10. 0: corrections show as
   * jumps. Below 0: the default, 0.05. */
  double smoothing_s;
} tandem_sample_options;
/** The defaults. */
#define TANDEM_SAMPLE_OPTIONS_INIT \
  { sizeof(tandem_sample_options), TANDEM_EXTRAPOLATE, 0, -1.0 }

/** Where tandem_sample() writes the bodies: one array for each kind of value, null for values that are not
 * wanted. Body i of a column begins i strides after the pointer, so a column may be a member of an array of
 * structs. A stride is in bytes. It is a multiple of the element's alignment and not shorter than the
 * element; 0: packed. Columns must not overlap. */
typedef struct tandem_columns {
  uint32_t size;
  uint32_t capacity; /**< number of bodies that every array below has room for */
  float* positions;  /**< x, y, z; scene units */
  float* velocities; /**< x, y, z; scene units / s: how fast `positions` move, including a correction that is
                        being blended in. With `smoothing_s` 0: as the bodies move on the server */
  float* orientations; /**< quaternion x, y, z, w of norm 1, from the body's frame to the world's; q and -q
                          are the same orientation. Not written if the session has no orientations. Trajectory
                          files have w first */
  float* angular_velocities; /**< x, y, z in the world's frame; rad / s; without corrections. Not written if
                                the session has no orientations */
  uint16_t* types;           /**< for tandem_get_type() */
  uint8_t* alive;            /**< 1: the slot holds a body. 0: only `changes` is meaningful */
  uint8_t* reuse;            /**< counts the bodies that a slot has held; wraps */
  uint8_t* changes;          /**< TANDEM_CHANGE_..., against this client's previous sample */
  uint32_t position_stride;
  uint32_t velocity_stride;
  uint32_t orientation_stride;
  uint32_t angular_velocity_stride;
  uint32_t type_stride;
  uint32_t alive_stride;
  uint32_t reuse_stride;
  uint32_t change_stride;
} tandem_columns;
/** No columns are wanted. */
#define TANDEM_COLUMNS_INIT \
  { sizeof(tandem_columns), 0, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, 0, 0, 0, 0, 0, 0, 0, 0 }

/** What tandem_sample() returned. */
typedef struct tandem_frame {
  uint32_t size;
  uint32_t capacity;          /**< slots of the session: each column received this many bodies */
  uint64_t epoch;             /**< one run of a server */
  double frame;               /**< the moment that is drawn, in frames */
  double seconds_since_delta; /**< since the server's last delta: the drawn state is a guess for so long */
  uint32_t alive;             /**< slots that hold a body */
  uint32_t has_orientations;  /**< 1: the session has them. 0: its bodies are points */
  tandem_sample_mode mode;    /**< in force */
  tandem_phase phase;         /**< TANDEM_JOINING: the last bodies known, while the client joins again */
} tandem_frame;
/** An empty one, to be filled in. */
#define TANDEM_FRAME_INIT \
  { sizeof(tandem_frame), 0, 0, 0, 0, 0, 0, 0, 0 }

/** Reads the clock of tandem_sample_options::at_ns: the system's CLOCK_MONOTONIC, nanoseconds. */
TANDEM_API int64_t tandem_clock_ns(void) TANDEM_NOEXCEPT;

/** Writes the bodies as they should be drawn at a moment. It never changes what the client holds. It may be
 * called at any rate and from any thread. It waits only for other samples of this client; only the first
 * call waits as other functions do. O(capacity). It allocates only when the session's capacity changed.
 * @param options  null: the defaults
 * @param columns  where to write; null: only `frame` is filled in
 * @param frame    may be null
 * @return also TANDEM_NOT_READY (nothing to draw yet) and TANDEM_CAPACITY (the session has more slots than
 * the columns have room for: nothing was sampled, but frame->capacity says how many slots there are and
 * frame->has_orientations whether the bodies turn) */
TANDEM_API tandem_result tandem_sample(tandem_client client, const tandem_sample_options* options,
                                       const tandem_columns* columns, tandem_frame* frame) TANDEM_NOEXCEPT;
/** @} */

/** @name Events
 * @{ */
/** What happened: one of the constants below. */
typedef int32_t tandem_event_kind;
/** Values of tandem_event_kind. */
enum {
  TANDEM_EVENT_PLAYING = 1,        /**< plays for the first time in this epoch: `frame` is held */
  TANDEM_EVENT_LOST = 2,           /**< plays no longer and joins again; `text` says why */
  TANDEM_EVENT_REJOINED = 3,       /**< plays again, in the same epoch: `frame` is held */
  TANDEM_EVENT_REFUSED = 4,        /**< the session cannot be played; `text` says why */
  TANDEM_EVENT_DEMOTED = 5,        /**< changed from participant to observer; `text` says why */
  TANDEM_EVENT_PROMOTED = 6,       /**< changed from observer to participant */
  TANDEM_EVENT_INPUT_ACTED = 7,    /**< input `number` acted on `frame`, which is held */
  TANDEM_EVENT_INPUT_REFUSED = 8,  /**< the server refused input `number`; see `reason` and `text` */
  TANDEM_EVENT_INPUT_UNKNOWN = 9,  /**< the outcome of input `number` will never be known */
  TANDEM_EVENT_SESSION_ENDED = 10, /**< the server is gone; the last state stays */
  TANDEM_EVENT_NEW_EPOCH = 11,     /**< another run of a server: `epoch`. The old epoch's state is void */
  TANDEM_EVENT_SESSION_BACK = 12,  /**< the server that was gone is back, in the same epoch */
  /** Input `number` did not act: the server went on from a frame before it (tandem_scene::continues_frame).
   * Comes once, after TANDEM_EVENT_NEW_EPOCH, also if TANDEM_EVENT_INPUT_ACTED came in the epoch before. */
  TANDEM_EVENT_INPUT_LOST = 13
};

/** One event. Fields that its kind does not mention are 0. */
typedef struct tandem_event {
  uint32_t size;
  tandem_event_kind kind;
  uint64_t number; /**< the input's number, as tandem_send_...() returned it */
  uint64_t frame;
  uint64_t epoch;
  int64_t at_ns;    /**< when the client recorded it, by tandem_clock_ns() */
  uint32_t reason;  /**< the server's reason: "Reasons" in idl/PROTOCOL.md */
  uint32_t dropped; /**< events that a full queue dropped between the previously taken one and this one */
  char text[256];   /**< for a human; may be empty. If an input was refused, these are the simulation's own
                       words, if it gave some */
} tandem_event;
/** An empty one, to be filled in. */
#define TANDEM_EVENT_INIT                            \
  {                                                  \
    sizeof(tandem_event), 0, 0, 0, 0, 0, 0, 0, { 0 } \
  }

/** Takes the oldest event from the client's queue. The queue holds 256 events; when it is full, the oldest
 * are dropped and counted.
 * @return also TANDEM_NOT_READY: there is no event */
TANDEM_API tandem_result tandem_next_event(tandem_client client, tandem_event* event) TANDEM_NOEXCEPT;
/** @} */

/** @name Keys and events of a session
 * A server may keep keys with values (a score, the phase of the game), which every client has from its join on, and
 * broadcast events (a goal, a hit), of which each client that plays hears once. Both belong to a frame.
 * @{ */
/** What a tandem_news tells: one of the constants below. */
typedef int32_t tandem_news_kind;
/** Values of tandem_news_kind. */
enum {
  TANDEM_NEWS_EVENT = 1, /**< event `number` happened on `frame`: kind, body if has_body is 1, bytes */
  TANDEM_NEWS_KEY = 2,   /**< from `frame` on `key` has a value of byte_count bytes, or is gone */
  /** `number` events up to `frame` are lost for this client: it had to join again, or its queue was full. Changes of
   * keys may be missing, too: tandem_get_key() has the values. */
  TANDEM_NEWS_LOST = 3,
  /** The last `number` events, of frames beyond `frame`, did not happen: the server went on from there. */
  TANDEM_NEWS_TAKEN_BACK = 4
};

/** News of a session. Fields that its kind does not mention are 0. */
typedef struct tandem_news {
  uint32_t size;
  tandem_news_kind what;
  uint64_t epoch;
  uint64_t frame;  /**< it is in a picture of which tandem_frame::frame is at least this */
  uint64_t number; /**< of the event, from 1 on, over epochs that continue each other; or how many events */
  uint32_t kind;   /**< of the event; what it means is the server's */
  uint32_t has_body;
  uint32_t slot;       /**< of the body that the event is about */
  uint32_t reuse;      /**< as in tandem_columns: the slot may hold another body now */
  uint32_t byte_count; /**< of the event; or of the key's value, which tandem_get_key() reads */
  uint32_t gone;       /**< 1: there is no such key any more */
  char key[72];
  uint8_t bytes[1024]; /**< of the event */
} tandem_news;
/** An empty one, to be filled in. */
#define TANDEM_NEWS_INIT                                           \
  {                                                                \
    sizeof(tandem_news), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, {0}, { 0 } \
  }

/** Takes the oldest news from the client's queue. It holds 4,096 of them, with 1 MiB of bytes; when it is full, the
 * oldest are dropped, which TANDEM_NEWS_LOST tells.
 * @return also TANDEM_NOT_READY: there are none */
TANDEM_API tandem_result tandem_next_news(tandem_client client, tandem_news* news) TANDEM_NOEXCEPT;
/** Writes the value that a key has at the last frame applied.
 * @param value     `capacity` bytes; may be null if capacity is 0
 * @param count     receives how many there are, also with TANDEM_CAPACITY; may be null
 * @return also TANDEM_NOT_READY (there is no such key), TANDEM_CAPACITY: there are more than `capacity`, which is not
 * 0; the first were written */
TANDEM_API tandem_result tandem_get_key(tandem_client client, const char* key, void* value, size_t capacity,
                                        size_t* count) TANDEM_NOEXCEPT;
/** The size of an array that every key fits into, with the 0 at its end. */
#define TANDEM_KEY_SIZE 65
/** Writes a key of the session; they ascend by their bytes.
 * @param index  0, 1, ...
 * @param key    receives ASCII
 * @param size   bytes of `key`, at least 1; a key that is too long is cut
 * @return also TANDEM_NOT_READY: there are not so many */
TANDEM_API tandem_result tandem_get_key_name(tandem_client client, uint32_t index, char* key,
                                             size_t size) TANDEM_NOEXCEPT;
/** @} */

/** @name Data of bodies
 * A server may give each body data beside its motion (health, a temperature, a colour), which clients have without loss.
 * @{ */
/** What a field holds: one of the constants below. */
typedef int32_t tandem_data_kind;
/** Values of tandem_data_kind. */
enum {
  TANDEM_DATA_U8 = 0,
  TANDEM_DATA_I8 = 1,
  TANDEM_DATA_U16 = 2,
  TANDEM_DATA_I16 = 3,
  TANDEM_DATA_U32 = 4,
  TANDEM_DATA_I32 = 5,
  TANDEM_DATA_F32 = 6,
  TANDEM_DATA_RGBA = 7 /**< four bytes: red, green, blue, opacity */
};

/** A field of the data of bodies. */
typedef struct tandem_data_field {
  uint32_t size;
  tandem_data_kind kind;
  uint32_t offset;     /**< of its value in a body's record, bytes */
  uint32_t value_size; /**< of its value, bytes */
  char name[40];
} tandem_data_field;
/** An empty one, to be filled in. */
#define TANDEM_DATA_FIELD_INIT                   \
  {                                              \
    sizeof(tandem_data_field), 0, 0, 0, { 0 }    \
  }

/** Writes one of the fields that the session has.
 * @param index  0, 1, ..., in the order of a record
 * @return also TANDEM_NOT_READY: there are not so many, or no session is known yet */
TANDEM_API tandem_result tandem_get_data_field(tandem_client client, uint32_t index,
                                               tandem_data_field* field) TANDEM_NOEXCEPT;
/** Writes the values of a field of all bodies at the last frame applied, by slot, little-endian, without gaps; zeros for
 * slots without a body. A picture may be of a moment a little before or after that frame.
 * @param name      the field; null: all fields, as records without gaps
 * @param values    `capacity` bytes; may be null if capacity is 0
 * @param count     receives how many bytes there are, also with TANDEM_CAPACITY; may be null
 * @param frame     receives the frame; may be null
 * @return also TANDEM_NOT_READY (it does not play, or its stream has no data), TANDEM_INVALID_ARGUMENT (no such field),
 * TANDEM_CAPACITY: there are more bytes than `capacity`, which is not 0; nothing was written */
TANDEM_API tandem_result tandem_get_data(tandem_client client, const char* name, void* values, size_t capacity,
                                         size_t* count, uint64_t* frame) TANDEM_NOEXCEPT;
/** @} */

/** @name Acting
 * An input acts on the same frame everywhere. An event tells on which frame, or why it was refused. The
 * numbers of a client's inputs count up as long as the client lives. Each of these functions also returns
 * TANDEM_NOT_READY (not playing), TANDEM_OUT_OF_ORDER (joined as an observer) and TANDEM_TRANSPORT. Values
 * that are not finite are TANDEM_INVALID_ARGUMENT.
 * @{ */
/** Changes the gravity.
 * @param scene_units_per_s2  x, y, z
 * @param number              receives the input's number; may be null */
TANDEM_API tandem_result tandem_send_gravity(tandem_client client, const double scene_units_per_s2[3],
                                             uint64_t* number) TANDEM_NOEXCEPT;
/** Adds a velocity to the bodies around a point.
 * @param centre    x, y, z; scene units
 * @param radius    scene units
 * @param velocity  x, y, z; scene units / s
 * @param number    receives the input's number; may be null */
TANDEM_API tandem_result tandem_send_push(tandem_client client, const double centre[3], double radius,
                                          const double velocity[3], uint64_t* number) TANDEM_NOEXCEPT;
/** Sends bytes whose meaning only the server's simulation knows.
 * @param bytes   may be null if count is 0
 * @param count   0..1,024
 * @param number  receives the input's number; may be null */
TANDEM_API tandem_result tandem_send_bytes(tandem_client client, const void* bytes, size_t count,
                                           uint64_t* number) TANDEM_NOEXCEPT;
/** @} */

/** @name What a session is made of
 * All of these functions also return TANDEM_NOT_READY before a session is known. A new epoch
 * (TANDEM_EVENT_NEW_EPOCH) may change everything that they return.
 * @{ */
/** The form of a type of bodies, or of a solid: one of the constants below. */
typedef int32_t tandem_shape;
/** Values of tandem_shape: in the body's frame, scene units. */
enum {
  TANDEM_SHAPE_NONE = 0,
  TANDEM_SHAPE_SPHERE = 1,   /**< no values: the type's radius is the sphere's */
  TANDEM_SHAPE_BOX = 2,      /**< half sizes x, y, z */
  TANDEM_SHAPE_CAPSULE = 3,  /**< radius, half of the length between the centres of the caps, along y */
  TANDEM_SHAPE_CYLINDER = 4, /**< radius, half of the height, along y */
  TANDEM_SHAPE_HULL = 5,     /**< convex: points x, y, z, at least four */
  TANDEM_SHAPE_PLANE = 6     /**< for solids only */
};

/** The scene of a session. */
typedef struct tandem_scene {
  uint32_t size;
  uint32_t capacity;    /**< slots */
  uint32_t type_count;  /**< for tandem_get_type() */
  uint32_t solid_count; /**< for tandem_get_geometry() */
  double frame_rate_hz;
  double gravity[3];  /**< gravity at the epoch's first frame; scene units / s^2 */
  double max_gravity; /**< scene units / s^2; the server refuses more; 0: unknown */
  double max_push;    /**< scene units / s; the server refuses more; 0: unknown */
  float low[3];       /**< bodies outside of low..high are removed; all 0: unknown */
  float high[3];
  char name[72];
  double dt_s;              /**< seconds that one frame simulates */
  uint64_t continues_epoch; /**< the epoch that this one continues; 0: none */
  uint64_t continues_frame; /**< the frame of that epoch from which this one continues */
  uint32_t up_axis;         /**< the axis that points up: 0 x, 1 y, 2 z */
  uint32_t reserved;        /**< 0 */
} tandem_scene;
/** An empty one, to be filled in. */
#define TANDEM_SCENE_INIT \
  { sizeof(tandem_scene), 0, 0, 0, 0, {0, 0, 0}, 0, 0, {0, 0, 0}, {0, 0, 0}, {0}, 0, 0, 0, 0, 0 }

/** Fills in the scene of the session.
 * @return also TANDEM_MALFORMED (the server's description of the scene cannot be read) */
TANDEM_API tandem_result tandem_get_scene(tandem_client client, tandem_scene* scene) TANDEM_NOEXCEPT;

/** A part of the scene that does not move. Fields that its shape does not use are 0, orientation 0 0 0 1. */
typedef struct tandem_solid {
  uint32_t size;
  tandem_shape shape;   /**< TANDEM_SHAPE_PLANE, _BOX or _SPHERE */
  float centre[3];      /**< centre; for a plane: any point on it */
  float orientation[4]; /**< box: quaternion x, y, z, w, from its frame to the world's */
  float half_size[3];   /**< box: half sizes x, y, z */
  float normal[3];      /**< plane: norm 1; points to the side where the bodies are */
  float radius;         /**< sphere only */
} tandem_solid;
/** An empty one, to be filled in. */
#define TANDEM_SOLID_INIT \
  { sizeof(tandem_solid), 0, {0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 0 }

/** Writes the geometry of the scene.
 * @param solids    `capacity` structs, the first with its size; may be null if capacity is 0
 * @param capacity  maximum number of structs to write
 * @param count     receives how many the scene has, also with TANDEM_CAPACITY
 * @return also TANDEM_MALFORMED, as tandem_get_scene(), and TANDEM_CAPACITY: there are more than `capacity`,
 * which is not 0; the first ones were written */
TANDEM_API tandem_result tandem_get_geometry(tandem_client client, tandem_solid* solids, size_t capacity,
                                             size_t* count) TANDEM_NOEXCEPT;

/** The appearance of the bodies of a type. */
typedef struct tandem_body_type {
  uint32_t size;
  tandem_shape shape;
  float radius;         /**< of the sphere around the body; scene units */
  uint32_t colour_rgba; /**< 0xRRGGBBAA */
  uint32_t value_count; /**< number of values of the shape, for tandem_get_type_values() */
  float values[3];      /**< the first of those values: all of them, except for a hull */
  char name[72];
} tandem_body_type;
/** An empty one, to be filled in. */
#define TANDEM_BODY_TYPE_INIT                              \
  {                                                        \
    sizeof(tandem_body_type), 0, 0, 0, 0, {0, 0, 0}, { 0 } \
  }

/** Fills in a type of bodies; tandem_scene::type_count says how many types there are.
 * @param index  as in tandem_columns::types */
TANDEM_API tandem_result tandem_get_type(tandem_client client, uint32_t index,
                                         tandem_body_type* type) TANDEM_NOEXCEPT;
/** Writes all values of a type's shape, such as the points of a hull.
 * @param values    `capacity` floats; may be null if capacity is 0
 * @param count     receives how many there are, also with TANDEM_CAPACITY
 * @return also TANDEM_CAPACITY: there are more than `capacity`, which is not 0; the first were written */
TANDEM_API tandem_result tandem_get_type_values(tandem_client client, uint32_t index, float* values,
                                                size_t capacity, size_t* count) TANDEM_NOEXCEPT;
/** The size of an array that every name of a body fits into, with the 0 at its end. */
#define TANDEM_BODY_NAME_SIZE 65
/** Writes the name of the body that is in a slot now: an empty text if the body has none or there is no body.
 * Names may change while the client plays.
 * @param name  receives UTF-8 without control characters
 * @param size  bytes of `name`, at least 1; a name that is too long is cut at the end of a character
 * @return also TANDEM_NOT_READY: not playing */
TANDEM_API tandem_result tandem_get_body_name(tandem_client client, uint32_t slot, char* name,
                                              size_t size) TANDEM_NOEXCEPT;
/** @} */

/** @name Finding sessions
 * @{ */
/** A watcher of a DDS domain. */
typedef uint64_t tandem_browser;

/** A session on a domain. What is not known yet is 0 or empty; a server tells its status once a second. */
typedef struct tandem_session_info {
  uint32_t size;
  uint32_t playable; /**< 1: tandem_join() can play it. 0: its version or codec is unknown here */
  uint64_t epoch;    /**< one run of a server */
  uint32_t capacity; /**< slots */
  uint32_t bodies;   /**< bodies alive; this and the next two come from the status */
  uint32_t participants;
  uint32_t observers;
  double frame_rate_hz;
  double client_ms;  /**< computing time of a client for one frame, measured on the server's processor */
  double mbit_per_s; /**< current payload rate; from the status */
  uint32_t protocol_version;
  uint32_t reserved; /**< 0 */
  char name[72];     /**< for tandem_options::session */
  char scene[72];
  char codec[72];
  char predictor[72];
  double dt_s;              /**< seconds that one frame simulates */
  double gravity[3];        /**< at the epoch's first frame; scene units / s^2 */
  uint64_t continues_epoch; /**< the epoch that this one continues; 0: none */
  uint64_t continues_frame; /**< the frame of that epoch from which this one continues */
  uint32_t up_axis;         /**< the axis that points up: 0 x, 1 y, 2 z */
  uint32_t reserved2;       /**< 0 */
} tandem_session_info;
/** An empty one, to be filled in. */
#define TANDEM_SESSION_INFO_INIT                                                                             \
  {                                                                                                          \
    sizeof(tandem_session_info), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, {0}, {0}, {0}, {0}, 0, {0, 0, 0}, 0, 0, 0, \
        0                                                                                                    \
  }

/** Starts watching a domain without joining anything.
 * @param domain   0..230
 * @param browser  the new browser, to be closed by tandem_browser_close()
 * @return also TANDEM_TRANSPORT (DDS could not start) */
TANDEM_API tandem_result tandem_browser_open(uint32_t domain, tandem_browser* browser) TANDEM_NOEXCEPT;
/** The same with options, of which only `domain`, `profile` and `secure` are used.
 * @param options  null: the defaults */
TANDEM_API tandem_result tandem_browser_open_with(const tandem_options* options,
                                                  tandem_browser* browser) TANDEM_NOEXCEPT;
/** Writes the sessions that are on the domain now, sorted by name. Does not wait: right after
 * tandem_browser_open() no session is known; each is found within one or two seconds.
 * @param sessions  `capacity` structs, the first with its size; may be null if capacity is 0
 * @param capacity  maximum number of structs to write
 * @param count     receives how many there are, also with TANDEM_CAPACITY
 * @return also TANDEM_CAPACITY: there are more than `capacity`, which is not 0; the first were written */
TANDEM_API tandem_result tandem_browser_list(tandem_browser browser, tandem_session_info* sessions,
                                             size_t capacity, size_t* count) TANDEM_NOEXCEPT;
/** Frees everything that the browser holds. Waits for calls of other threads with it. */
TANDEM_API tandem_result tandem_browser_close(tandem_browser browser) TANDEM_NOEXCEPT;
/** @} */

/** @name Replays
 * @{ */
/** EXPERIMENTAL. Sends an input that moves the replay of a recording to another time, for all clients and
 * under a new epoch. The results are those of "Acting". TANDEM_EVENT_NEW_EPOCH tells that the replay has
 * moved; because that event ends the epoch of the input, the input's own event may be
 * TANDEM_EVENT_INPUT_UNKNOWN. The server refuses the input with reason 3 if the time is beyond the recording
 * or the session is not a replay, and with reason 4 less than a second after another seek.
 * @param seconds  since the first message of the recording, 0 up to its length
 * @param number   receives the input's number; may be null */
TANDEM_API tandem_result tandem_send_seek(tandem_client client, double seconds,
                                          uint64_t* number) TANDEM_NOEXCEPT;
/** @} */

#ifdef __cplusplus
}
#endif

#endif
