#ifndef TANDEM_TANDEM_H
#define TANDEM_TANDEM_H

#include <stddef.h>
#include <stdint.h>

/**
 * @file
 * Tandem: holds a physical simulation that runs on a server, body by body and bit by bit as the server has
 * it, to draw it and to act on it. This header is the manual of the client SDK; every other language stands
 * on it.
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
 * Handles   A client or browser is a number that is never used twice in a process; 0 is none. A call with one
 *           that was closed, or never was, returns TANDEM_INVALID_HANDLE, also while others close it. Close
 *           them before main() returns.
 * Results   Functions return TANDEM_OK (0) or what went wrong; tandem_error_text() has a line for a human, of
 *           the last failure in the calling thread. Where a call fails, its outputs are as they were, unless
 *           its text says otherwise. No C++ exception leaves a function; without memory it is
 *           TANDEM_OUT_OF_MEMORY. Every function may return TANDEM_INVALID_ARGUMENT (a null pointer where the
 *           text does not allow it, a size or number out of range), TANDEM_INVALID_HANDLE,
 *           TANDEM_IN_CALLBACK, TANDEM_OUT_OF_MEMORY and TANDEM_INTERNAL; the texts name the others.
 * Structs   begin with `size`: set it with the struct's ..._INIT; no function changes it. Of an array of
 *           structs the first one's counts for all. A program built against an older header runs with a newer
 *           library, and the other way round where it leaves zero what the older library does not know
 *           (TANDEM_UNSUPPORTED otherwise); what that library cannot fill in is zero.
 * Threads   All functions may be called from any thread, unless they say otherwise. tandem_sample() never
 *           waits for the network, for decoding or for applying; the others may wait until the frame in work
 *           is applied. From a callback only tandem_error_text(), tandem_result_text(), tandem_clock_ns() and
 *           the version's functions may be called: all others return TANDEM_IN_CALLBACK.
 * Memory    Arrays and structs are the caller's; nothing of them is kept after the call. Texts in structs end
 *           with 0 and are cut where they are too long. What is buffered is bounded, however seldom a client
 *           is updated.
 * Processes Clients of one process and domain share the DDS domain: its sockets, threads and discovery. Each
 *           has a participant and endpoints of its own. After fork() the child has none of its parent's
 *           clients, and cannot join (TANDEM_TRANSPORT) before it has called exec().
 * Units     Scene units (metres, as a rule), seconds, radians; right-handed as the scene. Frames begin at 1.
 *
 * What is not marked EXPERIMENTAL keeps its meaning and binary form until the next major version.
 */

/* Set before this is included where the static library is linked or the symbols are wrapped. */
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
 * Of the API, by semantic versioning, and the one place where it is written down.
 * @{ */
#define TANDEM_VERSION_MAJOR 0 /**< a new one may break programs */
#define TANDEM_VERSION_MINOR 1 /**< a new one adds */
#define TANDEM_VERSION_PATCH 0 /**< a new one mends */
/** Of this header, to compare with tandem_version_number(). */
#define TANDEM_VERSION_NUMBER \
  (TANDEM_VERSION_MAJOR * 10000 + TANDEM_VERSION_MINOR * 100 + TANDEM_VERSION_PATCH)

/** Of the library at run time: "MAJOR.MINOR.PATCH". Lives for ever. */
TANDEM_API const char* tandem_version(void) TANDEM_NOEXCEPT;
/** Of the library at run time, as TANDEM_VERSION_NUMBER. */
TANDEM_API uint32_t tandem_version_number(void) TANDEM_NOEXCEPT;
/** @} */

/** @name Results
 * @{ */
/** What a call came to: one of the constants below. Their values never change; new ones are appended. */
typedef int32_t tandem_result;
/** Values of tandem_result; see "Results" above for those that every function may return. */
enum {
  TANDEM_OK = 0,
  TANDEM_INVALID_ARGUMENT = 1, /**< the caller passed something out of range */
  TANDEM_MALFORMED = 2,        /**< received bytes do not parse, or break a rule of the format */
  TANDEM_UNSUPPORTED = 3,      /**< of a version, or with a value, that this library does not know */
  TANDEM_MISMATCH = 4,         /**< applied, but the state hash differs from the sender's */
  TANDEM_OUT_OF_ORDER = 5,     /**< not possible in this role or at this moment */
  TANDEM_CAPACITY = 6,         /**< an array is too short, or a limit would be exceeded */
  TANDEM_TIMEOUT = 7,          /**< it did not come about in time */
  TANDEM_CONFLICT = 8,         /**< somebody else owns the name */
  TANDEM_TRANSPORT = 9,        /**< DDS reported an error */
  TANDEM_IO = 10,              /**< a file could not be read or written */
  TANDEM_INVALID_HANDLE = 11,  /**< closed, never made, or of another kind */
  TANDEM_NOT_READY = 12,       /**< nothing to draw, not playing, not known, or no event, yet */
  TANDEM_IN_CALLBACK = 13,     /**< called from a callback */
  TANDEM_WRONG_THREAD = 14,    /**< another thread does this already */
  TANDEM_OUT_OF_MEMORY = 15,
  TANDEM_INTERNAL = 16 /**< a fault of this library: please report its error text */
};

/** The name of a result, such as "TANDEM_TIMEOUT"; never null, lives for ever. */
TANDEM_API const char* tandem_result_text(tandem_result result) TANDEM_NOEXCEPT;
/** Says what went wrong in this thread's last call that failed, in one line of at most 511 bytes; empty
 * before the first. Valid until the next call of this thread that fails. */
TANDEM_API const char* tandem_error_text(void) TANDEM_NOEXCEPT;
/** @} */

/** @name Joining
 * @{ */
/** A client of one session. */
typedef uint64_t tandem_client;

/** Of a client, in a session: one of the constants below. */
typedef int32_t tandem_role;
/** Values of tandem_role. */
enum {
  TANDEM_OBSERVER = 0,   /**< only watches; the server never waits for it */
  TANDEM_PARTICIPANT = 1 /**< may send input, and the server waits for it, within limits */
};

/** Where a client stands: one of the constants below. */
typedef int32_t tandem_phase;
/** Values of tandem_phase. */
enum {
  TANDEM_SEARCHING = 0, /**< no live server of that session seen */
  TANDEM_REFUSED = 1, /**< a session is there that this client cannot play; tandem_status::reason says why */
  TANDEM_JOINING = 2, /**< waiting for a snapshot */
  TANDEM_PLAYING = 3  /**< holds the agreed state and follows it */
};

/** Of a line of the log: one of the constants below. */
typedef int32_t tandem_log_level;
/** Values of tandem_log_level. */
enum { TANDEM_LOG_INFO = 0, TANDEM_LOG_WARNING = 1, TANDEM_LOG_ERROR = 2 };

/** Gets one line for a human, without a line end, valid during the call. Called from the thread that does the
 * client's work, while the client is locked: return soon, throw nothing, and do not wait for a thread that
 * may be in a call with this client. */
typedef void (*tandem_log)(void* user, tandem_log_level level, const char* line);

/** What tandem_join() is told. */
typedef struct tandem_options {
  uint32_t size;
  uint32_t domain;     /**< DDS domain, 0..230 */
  const char* session; /**< 1..64 characters of [A-Za-z0-9._-]; null: "default" */
  tandem_role role;
  uint32_t lead; /**< frames to simulate beyond the last delta, 0 or 1; clamped to what the session allows */
  /** 1: a thread of the client's own does the work. 0: the application calls tandem_update(), at least once a
   * frame, and everything happens in there; the only threads are those of Cyclone DDS. */
  uint32_t background;
  /** EXPERIMENTAL. 1: tandem_sample() shows the application's own gravity at once, before the server has said
   * when it acts. */
  uint32_t echo;
  tandem_log log; /**< may be null */
  void* user;     /**< handed to `log` */
  /** Of the session's streams: "auto" (fewest bits, where that costs this processor little), "bandwidth"
   * (fewest bits), "computing" (cheapest), "error" (smallest), or a stream's name. A stream is changed while
   * it is played when processor or link cannot follow it, or another suits better, but for one that was
   * named. Null: "auto". */
  const char* prefer;
} tandem_options;
/** The defaults. */
#define TANDEM_OPTIONS_INIT \
  { sizeof(tandem_options), 0, NULL, TANDEM_PARTICIPANT, 1, 1, 0, NULL, NULL, NULL }

/** Starts looking for a session; returns at once, whether a server is there or not.
 * @param options  null: the defaults
 * @param client   the new client, to be closed by tandem_leave()
 * @return also TANDEM_TRANSPORT (DDS could not start) */
TANDEM_API tandem_result tandem_join(const tandem_options* options, tandem_client* client) TANDEM_NOEXCEPT;

/** Leaves the session and frees all that the client holds. Waits for calls of other threads with this client,
 * which end soon: tandem_update() and tandem_wait_until_playing() return TANDEM_INVALID_HANDLE.
 *
 * For the last client of a process Cyclone DDS stops too, and 0.10 then waits for a packet to itself: where
 * the network interface is gone, this call does not return. An application that must not wait ends its process
 * without this call, or sets Internal/MultipleReceiveThreads to false in CYCLONEDDS_URI, with which DDS needs
 * no packet to stop. */
TANDEM_API tandem_result tandem_leave(tandem_client client) TANDEM_NOEXCEPT;

/** For a client without a thread: takes what arrived, follows the session, and waits for the next thing to
 * do.
 * @param wait_s  at most so long, seconds; 0 or less: not at all
 * @return also TANDEM_WRONG_THREAD (the client has a thread of its own, or another thread is in here) */
TANDEM_API tandem_result tandem_update(tandem_client client, double wait_s) TANDEM_NOEXCEPT;

/** Blocks until the client plays; updates it, where it has no thread.
 * @param timeout_s  seconds
 * @return also TANDEM_TIMEOUT, and as tandem_update() where the client has no thread */
TANDEM_API tandem_result tandem_wait_until_playing(tandem_client client, double timeout_s) TANDEM_NOEXCEPT;

/** Another preference of streams than the one joined with, as tandem_options::prefer: a device that saves its
 * battery, a link that is metered. The stream changes, if it has to, while the client plays. */
TANDEM_API tandem_result tandem_prefer(tandem_client client, const char* prefer) TANDEM_NOEXCEPT;

/** Figures since tandem_join(). Times in milliseconds, percentiles over all frames. */
typedef struct tandem_status {
  uint32_t size;
  tandem_phase phase;
  tandem_role role;          /**< as granted by the server */
  uint32_t lead;             /**< in force; lower than asked for where the session allows less */
  uint32_t server_alive;     /**< 1 or 0 */
  uint32_t queue_high_water; /**< deltas that waited at once, at most */
  uint64_t client_id;        /**< random; kept for as long as the client lives */
  uint64_t epoch;            /**< of the server's run; 0 before the first */
  uint64_t frame;            /**< last frame agreed with the server */
  uint64_t state_hash;       /**< of that frame */
  uint64_t frames_applied;
  uint64_t resyncs; /**< joins after the first one of an epoch */
  uint64_t hash_mismatches;
  uint64_t refused_messages; /**< bytes that broke a rule of the protocol */
  uint64_t payload_bytes;    /**< of deltas */
  uint64_t inputs_sent;
  uint64_t inputs_acted;
  uint64_t inputs_refused;
  uint64_t inputs_unknown; /**< lost on the way, or their answer was */
  uint64_t events_dropped; /**< before tandem_next_event() took them */
  double frame_rate_hz;
  double mbit_per_s;     /**< of payload since the first frame; 2^20 bits to the Mbit */
  double latency_ms_p50; /**< publish to applied; needs one clock for both hosts */
  double latency_ms_p99;
  double input_latency_ms_p50; /**< sent until the frame it acted on was applied */
  double input_latency_ms_p99;
  double client_ms_p50; /**< decode, apply and simulate, a frame */
  double client_ms_p99;
  double join_ms; /**< last join: from learning of the session, or of the loss, to playing */
  double round_trip_ms;
  double jitter_ms;
  char scene[72];
  char reason[256]; /**< why role or phase is not what was asked for; empty where it is */
  char stream[40];  /**< name of the stream that is played, or joined; its number where it has no name */
  char stream_reason[152]; /**< why that one, for a human */
  uint64_t stream_changes; /**< from one stream of a session to another */
} tandem_status;
/** An empty one, to be filled in. */
#define TANDEM_STATUS_INIT                                                                                  \
  {                                                                                                         \
    sizeof(tandem_status), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, \
        0, 0, 0, {0}, {0}, {0}, {0}, 0                                                                      \
  }

/** How the client stands. */
TANDEM_API tandem_result tandem_get_status(tandem_client client, tandem_status* status) TANDEM_NOEXCEPT;
/** @} */

/** @name Drawing
 * @{ */
/** Which moment is drawn: one of the constants below. */
typedef int32_t tandem_sample_mode;
/** Values of tandem_sample_mode. */
enum {
  TANDEM_INTERPOLATE = 0, /**< between the last two agreed frames: always true, a frame late */
  /** At the server's time: predicted, with corrections taken up by an offset that decays. Where nothing comes
   * from the server bodies go on for a moment, slow down and stand (tandem_frame::seconds_since_delta). */
  TANDEM_EXTRAPOLATE = 1
};

/** What a body did since the client's previous sample: one of the constants below. */
enum {
  TANDEM_CHANGE_NONE = 0,
  TANDEM_CHANGE_NEW = 1,   /**< was not there, or another body took its slot */
  TANDEM_CHANGE_GONE = 2,  /**< was there in the previous sample */
  TANDEM_CHANGE_JUMPED = 3 /**< the same body at another place: teleported, or the client had to join again */
};

/** What tandem_sample() is told. */
typedef struct tandem_sample_options {
  uint32_t size;
  tandem_sample_mode mode;
  /** The moment to draw, by tandem_clock_ns(), such as when the picture will be on the screen; 0: now. Far
   * past or future gives the nearest that is held, and tandem_frame::frame says which. */
  int64_t at_ns;
  /** Time constant of the offset that takes up corrections, seconds, at most 10. 0: they show as jumps; below
   * 0: the default, 0.05. */
  double smoothing_s;
} tandem_sample_options;
/** The defaults. */
#define TANDEM_SAMPLE_OPTIONS_INIT \
  { sizeof(tandem_sample_options), TANDEM_EXTRAPOLATE, 0, -1.0 }

/** Where the bodies go: an array for each thing that is wanted, null for what is not. Body i of a column
 * begins i strides behind its pointer, so a column may be a member of an array of structs. A stride is in
 * bytes, a multiple of the element's alignment and not shorter than it; 0: packed. Columns must not overlap.
 */
typedef struct tandem_columns {
  uint32_t size;
  uint32_t capacity; /**< bodies that every array below has room for */
  float* positions;  /**< x, y, z; scene units */
  float* velocities; /**< x, y, z; scene units / s: how fast `positions` move, with a correction that is being
                        blended in. With `smoothing_s` 0, as the bodies move on the server */
  float* orientations; /**< quaternion x, y, z, w of norm 1, from the body's frame to the world's; q and -q
                          are the same. Left as they are where the session has none. Trajectory files have w
                          first */
  float* angular_velocities; /**< x, y, z in the world's frame; rad / s; without corrections; likewise */
  uint16_t* types;           /**< for tandem_get_type() */
  uint8_t* alive;            /**< 1: the slot holds a body. 0: the other columns but `changes` say nothing */
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
/** No columns. */
#define TANDEM_COLUMNS_INIT \
  { sizeof(tandem_columns), 0, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, 0, 0, 0, 0, 0, 0, 0, 0 }

/** What was sampled. */
typedef struct tandem_frame {
  uint32_t size;
  uint32_t capacity;          /**< slots of the session: this many bodies were written to each column */
  uint64_t epoch;             /**< of the server's run */
  double frame;               /**< the moment that is drawn, in frames */
  double seconds_since_delta; /**< how long nothing has come from the server: what is drawn is a guess */
  uint32_t alive;             /**< slots that hold a body */
  uint32_t has_orientations;  /**< 1: the session has them. 0: its bodies are points */
  tandem_sample_mode mode;    /**< in force */
  tandem_phase phase;         /**< TANDEM_JOINING: the last bodies known, while the client joins again */
} tandem_frame;
/** An empty one, to be filled in. */
#define TANDEM_FRAME_INIT \
  { sizeof(tandem_frame), 0, 0, 0, 0, 0, 0, 0, 0 }

/** The clock of tandem_sample_options::at_ns: the system's monotonic one (CLOCK_MONOTONIC), nanoseconds. */
TANDEM_API int64_t tandem_clock_ns(void) TANDEM_NOEXCEPT;

/** The bodies as they should be drawn at a moment; never changes what the client holds. At any rate, from any
 * thread; never waits but for other samples of this client. Only the first call waits as other functions do.
 * O(capacity); allocates when the session's capacity changed only.
 * @param options  null: the defaults
 * @param columns  what is wanted; null: nothing but `frame`
 * @param frame    may be null
 * @return also TANDEM_NOT_READY (nothing to draw yet) and TANDEM_CAPACITY (the session has more slots than
 * the columns have room for: nothing was sampled, but frame->capacity tells how many, frame->has_orientations
 * whether they turn) */
TANDEM_API tandem_result tandem_sample(tandem_client client, const tandem_sample_options* options,
                                       const tandem_columns* columns, tandem_frame* frame) TANDEM_NOEXCEPT;
/** @} */

/** @name Events
 * @{ */
/** What happened: one of the constants below. */
typedef int32_t tandem_event_kind;
/** Values of tandem_event_kind. */
enum {
  TANDEM_EVENT_PLAYING = 1,        /**< first in this epoch: `frame` is held */
  TANDEM_EVENT_LOST = 2,           /**< plays no more and joins again; `text` says why */
  TANDEM_EVENT_REJOINED = 3,       /**< plays again, in the same epoch: `frame` is held */
  TANDEM_EVENT_REFUSED = 4,        /**< the session cannot be played; `text` says why */
  TANDEM_EVENT_DEMOTED = 5,        /**< a participant that became an observer; `text` says why */
  TANDEM_EVENT_PROMOTED = 6,       /**< is a participant now */
  TANDEM_EVENT_INPUT_ACTED = 7,    /**< input `number` acted on `frame`, which is held */
  TANDEM_EVENT_INPUT_REFUSED = 8,  /**< input `number`, by the server; `reason`, `text` */
  TANDEM_EVENT_INPUT_UNKNOWN = 9,  /**< nobody will know what became of input `number` */
  TANDEM_EVENT_SESSION_ENDED = 10, /**< the server is gone; the last state stays */
  TANDEM_EVENT_NEW_EPOCH = 11,     /**< another run of a server: `epoch`. Nothing of the old one counts */
  TANDEM_EVENT_SESSION_BACK = 12   /**< the server that was gone is there again, in the same epoch */
};

/** One event. What its kind does not name is 0. */
typedef struct tandem_event {
  uint32_t size;
  tandem_event_kind kind;
  uint64_t number; /**< of the input, as its sender was told */
  uint64_t frame;
  uint64_t epoch;
  int64_t at_ns;    /**< when the client noted it, by tandem_clock_ns() */
  uint32_t reason;  /**< the server's: "Reasons" in idl/PROTOCOL.md */
  uint32_t dropped; /**< older events that the queue had no room for since the one taken before */
  char text[256];   /**< for a human; may be empty */
} tandem_event;
/** An empty one, to be filled in. */
#define TANDEM_EVENT_INIT                            \
  {                                                  \
    sizeof(tandem_event), 0, 0, 0, 0, 0, 0, 0, { 0 } \
  }

/** Takes the oldest event from the client's queue, which holds 256; beyond, the oldest are dropped and
 * counted.
 * @return also TANDEM_NOT_READY: there is none */
TANDEM_API tandem_result tandem_next_event(tandem_client client, tandem_event* event) TANDEM_NOEXCEPT;
/** @} */

/** @name Acting
 * An input acts on the same frame everywhere; an event tells on which, or why not. Numbers count up for as
 * long as the client lives. Each of these also returns TANDEM_NOT_READY (not playing), TANDEM_OUT_OF_ORDER
 * (joined as an observer) and TANDEM_TRANSPORT; values that are not finite are TANDEM_INVALID_ARGUMENT.
 * @{ */
/** Gravity from now on.
 * @param scene_units_per_s2  x, y, z
 * @param number              the input's; may be null */
TANDEM_API tandem_result tandem_send_gravity(tandem_client client, const double scene_units_per_s2[3],
                                             uint64_t* number) TANDEM_NOEXCEPT;
/** Adds a velocity to the bodies around a point.
 * @param centre    x, y, z; scene units
 * @param radius    scene units
 * @param velocity  x, y, z; scene units / s
 * @param number    the input's; may be null */
TANDEM_API tandem_result tandem_send_push(tandem_client client, const double centre[3], double radius,
                                          const double velocity[3], uint64_t* number) TANDEM_NOEXCEPT;
/** Bytes for the server's simulation, which knows what they mean.
 * @param bytes   may be null where count is 0
 * @param count   0..1,024
 * @param number  the input's; may be null */
TANDEM_API tandem_result tandem_send_bytes(tandem_client client, const void* bytes, size_t count,
                                           uint64_t* number) TANDEM_NOEXCEPT;
/** @} */

/** @name What a session is made of
 * All of these also return TANDEM_NOT_READY before a session is known. With another epoch
 * (TANDEM_EVENT_NEW_EPOCH) everything may be another.
 * @{ */
/** The form of a type of bodies, or of a solid: one of the constants below. */
typedef int32_t tandem_shape;
/** Values of tandem_shape: in the body's frame, scene units. */
enum {
  TANDEM_SHAPE_NONE = 0,
  TANDEM_SHAPE_SPHERE = 1,   /**< no values: the radius */
  TANDEM_SHAPE_BOX = 2,      /**< half sizes x, y, z */
  TANDEM_SHAPE_CAPSULE = 3,  /**< radius, half of the length between the centres of the caps, along y */
  TANDEM_SHAPE_CYLINDER = 4, /**< radius, half of the height, along y */
  TANDEM_SHAPE_HULL = 5,     /**< convex: points x, y, z, at least four */
  TANDEM_SHAPE_PLANE = 6     /**< of solids alone */
};

/** The scene of a session. */
typedef struct tandem_scene {
  uint32_t size;
  uint32_t capacity;    /**< slots */
  uint32_t type_count;  /**< for tandem_get_type() */
  uint32_t solid_count; /**< for tandem_get_geometry() */
  double frame_rate_hz;
  double gravity[3];  /**< at the start; scene units / s^2 */
  double max_gravity; /**< beyond, the server refuses it; 0: not told */
  double max_push;    /**< scene units / s; beyond, the server refuses it; 0: not told */
  float low[3];       /**< bodies outside of low..high are removed; all 0: not told */
  float high[3];
  char name[72];
} tandem_scene;
/** An empty one, to be filled in. */
#define TANDEM_SCENE_INIT                                                          \
  {                                                                                \
    sizeof(tandem_scene), 0, 0, 0, 0, {0, 0, 0}, 0, 0, {0, 0, 0}, {0, 0, 0}, { 0 } \
  }

/** The scene of the session.
 * @return also TANDEM_MALFORMED (the server describes it in a way that cannot be read) */
TANDEM_API tandem_result tandem_get_scene(tandem_client client, tandem_scene* scene) TANDEM_NOEXCEPT;

/** One piece of a scene that does not move. What its shape does not name is 0, orientation 0, 0, 0, 1. */
typedef struct tandem_solid {
  uint32_t size;
  tandem_shape shape;   /**< TANDEM_SHAPE_PLANE, _BOX or _SPHERE */
  float centre[3];      /**< of a plane: a point of it */
  float orientation[4]; /**< of a box: quaternion x, y, z, w, from its frame to the world's */
  float half_size[3];   /**< of a box */
  float normal[3];      /**< of a plane: of norm 1; bodies are on the side that it points to */
  float radius;         /**< of a sphere */
} tandem_solid;
/** An empty one, to be filled in. */
#define TANDEM_SOLID_INIT \
  { sizeof(tandem_solid), 0, {0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 0 }

/** The geometry of the scene.
 * @param solids    `capacity` structs, the first with its size; may be null where capacity is 0
 * @param capacity  at most so many are written
 * @param count     how many the scene has; filled in with TANDEM_CAPACITY too
 * @return also TANDEM_MALFORMED, as tandem_get_scene(), and TANDEM_CAPACITY: there are more than `capacity`,
 * which is not 0; the first ones were written */
TANDEM_API tandem_result tandem_get_geometry(tandem_client client, tandem_solid* solids, size_t capacity,
                                             size_t* count) TANDEM_NOEXCEPT;

/** What bodies of a type look like. */
typedef struct tandem_body_type {
  uint32_t size;
  tandem_shape shape;
  float radius;         /**< of the sphere around the body; scene units */
  uint32_t colour_rgba; /**< 0xRRGGBBAA */
  uint32_t value_count; /**< of the shape's values, for tandem_get_type_values() */
  float values[3];      /**< the first of them: all, but of a hull */
  char name[72];
} tandem_body_type;
/** An empty one, to be filled in. */
#define TANDEM_BODY_TYPE_INIT                              \
  {                                                        \
    sizeof(tandem_body_type), 0, 0, 0, 0, {0, 0, 0}, { 0 } \
  }

/** A type of bodies; tandem_scene::type_count tells how many there are.
 * @param index  as in tandem_columns::types */
TANDEM_API tandem_result tandem_get_type(tandem_client client, uint32_t index,
                                         tandem_body_type* type) TANDEM_NOEXCEPT;
/** All values of a type's shape, such as the points of a hull.
 * @param values    `capacity` floats; may be null where that is 0
 * @param count     how many there are; filled in with TANDEM_CAPACITY too
 * @return also TANDEM_CAPACITY: there are more than `capacity`, which is not 0; the first ones were written
 */
TANDEM_API tandem_result tandem_get_type_values(tandem_client client, uint32_t index, float* values,
                                                size_t capacity, size_t* count) TANDEM_NOEXCEPT;
/** @} */

/** @name Finding sessions
 * @{ */
/** Watches a DDS domain. */
typedef uint64_t tandem_browser;

/** A session on a domain. What is not known yet is 0 or empty: status comes once a second. */
typedef struct tandem_session_info {
  uint32_t size;
  uint32_t playable; /**< 1: tandem_join() can play it. 0: another version, or a codec unknown here */
  uint64_t epoch;    /**< of the server's run */
  uint32_t capacity; /**< slots */
  uint32_t bodies;   /**< alive; from status, as are the next two */
  uint32_t participants;
  uint32_t observers;
  double frame_rate_hz;
  double client_ms;  /**< what a client computes in a frame, on the server's processor */
  double mbit_per_s; /**< of payload, now; from status */
  uint32_t protocol_version;
  uint32_t reserved; /**< 0 */
  char name[72];     /**< for tandem_options::session */
  char scene[72];
  char codec[72];
  char predictor[72];
} tandem_session_info;
/** An empty one, to be filled in. */
#define TANDEM_SESSION_INFO_INIT                                                       \
  {                                                                                    \
    sizeof(tandem_session_info), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, {0}, {0}, {0}, { 0 } \
  }

/** Starts watching a domain, without taking part in anything.
 * @param domain   0..230
 * @param browser  to be closed by tandem_browser_close()
 * @return also TANDEM_TRANSPORT (DDS could not start) */
TANDEM_API tandem_result tandem_browser_open(uint32_t domain, tandem_browser* browser) TANDEM_NOEXCEPT;
/** What is on the domain now, by name. Does not wait: right after tandem_browser_open() nothing is known; a
 * session is, within a second or two.
 * @param sessions  `capacity` structs, the first with its size; may be null where capacity is 0
 * @param capacity  at most so many are written
 * @param count     how many there are; filled in with TANDEM_CAPACITY too
 * @return also TANDEM_CAPACITY: there are more than `capacity`, which is not 0; the first ones were written
 */
TANDEM_API tandem_result tandem_browser_list(tandem_browser browser, tandem_session_info* sessions,
                                             size_t capacity, size_t* count) TANDEM_NOEXCEPT;
/** Frees all that the browser holds; waits for calls of other threads with it. */
TANDEM_API tandem_result tandem_browser_close(tandem_browser browser) TANDEM_NOEXCEPT;
/** @} */

/** @name Replays
 * @{ */
/** EXPERIMENTAL. An input, as those of "Acting" and with their results: the replay of a recording goes on at
 * another time, for everybody, under another epoch. TANDEM_EVENT_NEW_EPOCH tells that it does; as that ends
 * the epoch of the input, its own event may be TANDEM_EVENT_INPUT_UNKNOWN. It is refused with reason 3 beyond
 * the recording, or where the session is no replay; with 4 less than a second after another seek.
 * @param seconds  since the first message of the recording, 0 up to its length
 * @param number   the input's; may be null */
TANDEM_API tandem_result tandem_send_seek(tandem_client client, double seconds,
                                          uint64_t* number) TANDEM_NOEXCEPT;
/** @} */

#ifdef __cplusplus
}
#endif

#endif
