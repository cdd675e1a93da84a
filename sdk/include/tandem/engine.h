/* Hands the frames of a simulation to a Tandem server (idl/ENGINE.md). One file, C99, POSIX, no library.

   SPDX-License-Identifier: MIT

   Copyright (c) 2026 the authors of Tandem

   Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated
   documentation files (the "Software"), to deal in the Software without restriction, including without limitation the
   rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the Software, and to permit
   persons to whom the Software is furnished to do so, subject to the following conditions: The above copyright notice and
   this permission notice shall be included in all copies or substantial portions of the Software. THE SOFTWARE IS PROVIDED
   "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF
   MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT
   HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING
   FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.

       tandem_engine e;
       if (tandem_engine_open(&e, "name mine\ncapacity 100\ndt 0.0333\ninput gravity 50\n") != 0) return complain(e.error);
       float* x = tandem_engine_column(&e, "position", 0);
       ... fill all columns ...; tandem_engine_start(&e);
       for (;;) switch (tandem_engine_next(&e)) {
         case TANDEM_ENGINE_INPUT: ... e.kind, e.values, e.count ...; break;
         case TANDEM_ENGINE_STEP: ... step by dt, fill all columns ...; tandem_engine_done(&e, 0); break;
         default: return tandem_engine_close(&e);   (the server ended, or e.error says what is wrong)
       }

   The functions return 0, or -1 with a line in e.error; not thread-safe. They wait without using the processor. An engine
   may run on another machine than its server: TANDEM_DOOR is then tcp:HOST:PORT, and TANDEM_DOOR_TOKEN the server's token. */
#ifndef TANDEM_ENGINE_H
#define TANDEM_ENGINE_H

#ifndef _GNU_SOURCE
#define _GNU_SOURCE /* sockets with names of hosts, in strict C */
#endif
#include <errno.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#ifndef AI_PASSIVE
#error "In strict C, include tandem/engine.h before other headers, or compile with -D_GNU_SOURCE."
#endif

#ifdef __cplusplus
extern "C" {
#define TANDEM_ENGINE_AS(type, value) (static_cast<type>(value))
#define TANDEM_ENGINE_AT(type, value) (reinterpret_cast<type>(value))
#else
#define TANDEM_ENGINE_AS(type, value) ((type)(value))
#define TANDEM_ENGINE_AT(type, value) ((type)(value))
#endif

enum { /* messages on the socket */
  TANDEM_ENGINE_HELLO = 1, TANDEM_ENGINE_LAYOUT = 2, TANDEM_ENGINE_START = 3, TANDEM_ENGINE_INPUT = 4,
  TANDEM_ENGINE_STEP = 5, TANDEM_ENGINE_DONE = 6, TANDEM_ENGINE_SAVE = 7, TANDEM_ENGINE_SAVED = 8,
  TANDEM_ENGINE_LOAD = 9, TANDEM_ENGINE_LOADED = 10, TANDEM_ENGINE_ERROR = 11, TANDEM_ENGINE_BYE = 12,
  TANDEM_ENGINE_NEWS = 13
};
enum { TANDEM_ENGINE_GRAVITY = 1, TANDEM_ENGINE_PUSH = 2, TANDEM_ENGINE_APPLICATION = 16 }; /* kinds of inputs */
enum { TANDEM_ENGINE_EVENT = 1, TANDEM_ENGINE_KEY = 2, TANDEM_ENGINE_NO_KEY = 3 }; /* entries of NEWS */
enum { TANDEM_ENGINE_COLUMNS = 16, TANDEM_ENGINE_BODY = 65536, TANDEM_ENGINE_KEY_BYTES = 64 };
#define TANDEM_ENGINE_NO_SLOT 0xFFFFFFFFU

typedef struct {
  char name[24], kind[8]; /* kind: f32, f64, u8, u16 */
  uint32_t axes;
  uint64_t offset; /* from the slot's beginning */
} tandem_engine_column_info;

typedef struct tandem_engine {
  char error[256]; /* why a function returned -1 */
  /* What tandem_engine_next() returned is about this frame, and writes go to this slot. */
  uint64_t frame;
  uint32_t slot;
  /* TANDEM_ENGINE_INPUT: `count` values of a GRAVITY (x, y, z) or PUSH (centre, radius, change of velocity), or
     `count` bytes of an APPLICATION input. Valid until the next call. */
  uint32_t kind, count;
  const double* values;
  const unsigned char* bytes;
  const char* path; /* TANDEM_ENGINE_SAVE, _LOAD: the file to write or read, on this machine */
  /* The layout. An axis of a column is `padded` elements long, of which the first `capacity` count. */
  uint32_t capacity, padded, slots, is_inline;
  uint64_t first, slot_bytes, memory_bytes;
  uint32_t columns;
  tandem_engine_column_info column[TANDEM_ENGINE_COLUMNS];
  unsigned char* memory;
  int has_keys, has_events; /* of what the line `news` of HELLO asks for, what the server takes */
  int fd, is_remote;
  char file[1024]; /* is_remote: holds what is saved and loaded, which the messages bring */
  union { uint64_t align; unsigned char bytes[TANDEM_ENGINE_BODY + 8]; } body;
} tandem_engine;

static inline int tandem_engine_fail(tandem_engine* e, const char* what) {
  if (e->error[0] == 0) snprintf(e->error, sizeof e->error, "%.255s", what);
  return -1;
}

/* If the server hung up, this is no error: it may have said why, which tandem_engine_next() reads. */
static inline int tandem_engine_send(tandem_engine* e, uint32_t type, const void* body, size_t bytes, const void* tail, size_t tail_bytes) {
  uint32_t head[2];
  struct iovec part[3];
  struct msghdr message;
  head[0] = type;
  head[1] = TANDEM_ENGINE_AS(uint32_t, bytes + tail_bytes);
  part[0].iov_base = head, part[0].iov_len = sizeof head;
  memcpy(&part[1].iov_base, &body, sizeof body); /* iov_base is not const */
  memcpy(&part[2].iov_base, &tail, sizeof tail);
  part[1].iov_len = bytes, part[2].iov_len = tail_bytes;
  memset(&message, 0, sizeof message);
  message.msg_iov = part, message.msg_iovlen = 3;
  while (message.msg_iovlen > 0) {
    const ssize_t sent = sendmsg(e->fd, &message, MSG_NOSIGNAL);
    size_t left;
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return 0;
    left = TANDEM_ENGINE_AS(size_t, sent);
    while (message.msg_iovlen > 0 && left >= message.msg_iov[0].iov_len) {
      left -= message.msg_iov[0].iov_len;
      ++message.msg_iov;
      --message.msg_iovlen;
    }
    if (message.msg_iovlen > 0) {
      message.msg_iov[0].iov_base = TANDEM_ENGINE_AS(unsigned char*, message.msg_iov[0].iov_base) + left;
      message.msg_iov[0].iov_len -= left;
    }
  }
  return 0;
}

/* Receives exactly `bytes`; a descriptor that comes along is put into *passed, if that is not NULL. */
static inline int tandem_engine_receive(tandem_engine* e, void* to, size_t bytes, int* passed) {
  size_t held = 0;
  while (held < bytes) {
    union { struct cmsghdr align; char space[CMSG_SPACE(sizeof(int))]; } control;
    struct iovec part;
    struct msghdr message;
    struct cmsghdr* c;
    ssize_t got;
    memset(&message, 0, sizeof message);
    part.iov_base = TANDEM_ENGINE_AS(unsigned char*, to) + held, part.iov_len = bytes - held;
    message.msg_iov = &part, message.msg_iovlen = 1;
    if (passed != NULL) message.msg_control = control.space, message.msg_controllen = sizeof control.space;
    got = recvmsg(e->fd, &message, MSG_CMSG_CLOEXEC);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return tandem_engine_fail(e, "the server is gone, and did not say why");
    c = passed == NULL ? NULL : CMSG_FIRSTHDR(&message);
    if (c != NULL && c->cmsg_level == SOL_SOCKET && c->cmsg_type == SCM_RIGHTS) memcpy(passed, CMSG_DATA(c), sizeof(int));
    held += TANDEM_ENGINE_AS(size_t, got);
  }
  return 0;
}

static inline int tandem_engine_make_file(tandem_engine* e) {
  const char* const folder = getenv("TMPDIR");
  snprintf(e->file, sizeof e->file, "%.1000s/tandem-door-XXXXXX", folder != NULL ? folder : "/tmp");
  return mkstemp(e->file);
}

/* Receives a LOAD from another machine, and puts a path in its place. Returns the type, or -1. */
static inline int tandem_engine_take_file(tandem_engine* e, uint32_t* bytes) {
  unsigned char* const at = e->body.bytes + 8;
  uint32_t left = *bytes - 8, part;
  const int fd = tandem_engine_make_file(e);
  int good = fd >= 0 && tandem_engine_receive(e, e->body.bytes, 8, NULL) == 0;
  for (; good && left > 0; left -= part) {
    part = left < TANDEM_ENGINE_BODY - 8 ? left : TANDEM_ENGINE_BODY - 8;
    good = tandem_engine_receive(e, at, part, NULL) == 0 && write(fd, at, part) == TANDEM_ENGINE_AS(ssize_t, part);
  }
  if (fd >= 0) close(fd);
  *bytes = 9;
  memcpy(at, e->file, sizeof e->file);
  return good ? TANDEM_ENGINE_LOAD : tandem_engine_fail(e, "what is to be loaded cannot be written to a file");
}

/* Receives a message into e->body, with a 0 behind it. Returns its type, or -1. */
static inline int tandem_engine_message(tandem_engine* e, uint32_t* bytes, int* passed) {
  uint32_t head[2];
  if (tandem_engine_receive(e, head, sizeof head, passed) != 0) return -1;
  *bytes = head[1];
  if (head[0] == TANDEM_ENGINE_LOAD && e->is_remote && head[1] >= 8) return tandem_engine_take_file(e, bytes);
  if (head[1] > TANDEM_ENGINE_BODY) return tandem_engine_fail(e, "the server sent a message that is too long");
  if (tandem_engine_receive(e, e->body.bytes, head[1], NULL) != 0) return -1;
  e->body.bytes[head[1]] = 0;
  if (head[0] == TANDEM_ENGINE_ERROR) return tandem_engine_fail(e, TANDEM_ENGINE_AT(char*, e->body.bytes));
  return TANDEM_ENGINE_AS(int, head[0]);
}

static inline int tandem_engine_read_layout(tandem_engine* e) {
  unsigned long long a = 0, b = 0, c = 0, d = 0;
  char* line = TANDEM_ENGINE_AT(char*, e->body.bytes);
  while (line != NULL && *line != 0) {
    char* const end = strchr(line, '\n');
    tandem_engine_column_info* info = &e->column[e->columns];
    if (end != NULL) *end = 0;
    if (sscanf(line, "bytes %llu", &a) == 1) e->memory_bytes = a;
    if (sscanf(line, "first %llu", &a) == 1) e->first = a;
    if (sscanf(line, "slot_bytes %llu", &b) == 1) e->slot_bytes = b;
    if (sscanf(line, "capacity %u", &e->capacity) == 1) {}
    if (sscanf(line, "padded %u", &e->padded) == 1) {}
    if (sscanf(line, "slots %u", &e->slots) == 1) {}
    if (strcmp(line, "memory inline") == 0) e->is_inline = 1;
    if (strncmp(line, "news ", 5) == 0) e->has_keys = strstr(line, " keys") != NULL, e->has_events = strstr(line, " events") != NULL;
    if (e->columns < TANDEM_ENGINE_COLUMNS &&
        sscanf(line, "column %23s %7s %llu %llu", info->name, info->kind, &c, &d) == 4) {
      info->axes = TANDEM_ENGINE_AS(uint32_t, c);
      info->offset = d;
      ++e->columns;
    }
    line = end == NULL ? NULL : end + 1;
  }
  if (e->columns == 0 || e->slots == 0 || e->slot_bytes == 0) return tandem_engine_fail(e, "the server's LAYOUT is not understood");
  return 0;
}

/* Where the elements of one axis of a column begin, in the slot that is written now; NULL: there is no such column. The
   types are those of e->column[].kind: float or double, unsigned char (alive), unsigned short (type). */
static inline void* tandem_engine_column(const tandem_engine* e, const char* name, uint32_t axis) {
  uint32_t i;
  for (i = 0; i < e->columns; ++i) {
    const tandem_engine_column_info* c = &e->column[i];
    const uint64_t element = c->kind[1] == '8' ? 1 : c->kind[1] == '1' ? 2 : c->kind[1] == '3' ? 4 : 8;
    if (strcmp(c->name, name) == 0 && axis < c->axes)
      return e->memory + e->first + e->slot * e->slot_bytes + c->offset + axis * e->padded * element;
  }
  return NULL;
}

/* Ends the conversation. Returns 0, or 1 if e->error says that something was wrong, for main(). */
static inline int tandem_engine_close(tandem_engine* e) {
  if (e->memory != NULL && e->is_inline) free(e->memory);
  if (e->memory != NULL && !e->is_inline) munmap(e->memory, e->memory_bytes);
  if (e->fd >= 0) close(e->fd);
  e->memory = NULL, e->fd = -1;
  return e->error[0] == 0 ? 0 : 1;
}

/* Says HELLO, of which `first` are the first lines. */
static inline int tandem_engine_greet(tandem_engine* e, const char* first, const char* hello) {
  uint32_t bytes = 0;
  int memory = -1, type;
  if (tandem_engine_send(e, TANDEM_ENGINE_HELLO, first, strlen(first), hello, strlen(hello)) != 0) return -1;
  type = tandem_engine_message(e, &bytes, &memory);
  if (type < 0) return -1;
  if (type != TANDEM_ENGINE_LAYOUT || tandem_engine_read_layout(e) != 0) return tandem_engine_fail(e, "the server did not answer HELLO with LAYOUT");
  if (e->is_inline) {
    e->memory = TANDEM_ENGINE_AS(unsigned char*, calloc(1, e->slot_bytes));
    return e->memory != NULL ? 0 : tandem_engine_fail(e, "there is no memory for the columns");
  }
  if (memory < 0) return tandem_engine_fail(e, "the server passed no memory");
  {
    void* const mapped = mmap(NULL, e->memory_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, memory, 0);
    close(memory);
    if (mapped == MAP_FAILED) return tandem_engine_fail(e, "the server's memory cannot be mapped");
    e->memory = TANDEM_ENGINE_AS(unsigned char*, mapped);
  }
  return 0;
}

/* Says HELLO on a socket that is connected to a server. `hello`: lines as idl/ENGINE.md lists them, without the first
   one. The columns are there afterwards; types, velocities and so on begin as zeros: nobody lives. */
static inline int tandem_engine_open_fd(tandem_engine* e, int fd, const char* hello) {
  memset(e, 0, offsetof(tandem_engine, body)), e->fd = fd;
  return tandem_engine_greet(e, "engine 1.2\n", hello);
}

static inline int tandem_engine_open_port(tandem_engine* e, const char* place, const char* hello) {
  const char* const token = getenv("TANDEM_DOOR_TOKEN");
  const int one = 1;
  char host[256], port[16], first[320];
  struct addrinfo wanted, *found = NULL, *each;
  e->is_remote = 1;
  memset(&wanted, 0, sizeof wanted), wanted.ai_socktype = SOCK_STREAM;
  if ((sscanf(place, "[%255[^]]]:%15s", host, port) != 2 && sscanf(place, "%255[^:]:%15s", host, port) != 2) ||
      getaddrinfo(host, port, &wanted, &found) != 0)
    return tandem_engine_fail(e, "the host in TANDEM_DOOR is not known");
  for (each = found; each != NULL && e->fd < 0; each = each->ai_next) {
    e->fd = socket(each->ai_family, SOCK_STREAM, 0);
    if (e->fd >= 0 && connect(e->fd, each->ai_addr, each->ai_addrlen) == 0) continue;
    if (e->fd >= 0) close(e->fd);
    e->fd = -1;
  }
  freeaddrinfo(found);
  if (e->fd < 0) return tandem_engine_fail(e, "no server listens at TANDEM_DOOR");
  setsockopt(e->fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
  setsockopt(e->fd, SOL_SOCKET, SO_KEEPALIVE, &one, sizeof one);
  snprintf(first, sizeof first, "engine 1.2\nmemory inline\ntoken %.260s\n", token != NULL ? token : "-");
  return tandem_engine_greet(e, first, hello);
}

/* The same, with the server that the environment variable TANDEM_DOOR names: a path, fd:N or tcp:HOST:PORT. */
static inline int tandem_engine_open(tandem_engine* e, const char* hello) {
  const char* const door = getenv("TANDEM_DOOR");
  struct sockaddr_un address;
  int fd;
  memset(e, 0, offsetof(tandem_engine, body));
  e->fd = -1;
  if (door == NULL) return tandem_engine_fail(e, "TANDEM_DOOR is not set: start this program with tandemd --engine");
  if (strncmp(door, "tcp:", 4) == 0) return tandem_engine_open_port(e, door + 4, hello);
  if (strncmp(door, "fd:", 3) == 0) return tandem_engine_open_fd(e, atoi(door + 3), hello);
  memset(&address, 0, sizeof address);
  address.sun_family = AF_UNIX;
  if (strlen(door) >= sizeof address.sun_path) return tandem_engine_fail(e, "the path in TANDEM_DOOR is too long");
  strcpy(address.sun_path, door);
  fd = socket(AF_UNIX, SOCK_STREAM, 0);
  if (fd < 0 || connect(fd, TANDEM_ENGINE_AT(struct sockaddr*, &address), sizeof address) != 0) {
    if (fd >= 0) close(fd);
    return tandem_engine_fail(e, "no server listens at TANDEM_DOOR");
  }
  return tandem_engine_open_fd(e, fd, hello);
}

static inline int tandem_engine_answer(tandem_engine* e, uint32_t type, const void* body, size_t bytes, int with_slot) {
  unsigned char* const slot = e->memory + e->first + e->slot * e->slot_bytes;
  const int is_inline = with_slot && e->is_inline;
  if (with_slot) { /* begun, frame, done */
    memcpy(slot, &e->frame, 8);
    memcpy(slot + 8, &e->frame, 8);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    memcpy(slot + 16, &e->frame, 8);
  }
  return tandem_engine_send(e, type, body, bytes, slot, is_inline ? e->slot_bytes : 0);
}

/* The columns hold the start frame, or the frame that was loaded. */
static inline int tandem_engine_start(tandem_engine* e) { return tandem_engine_answer(e, TANDEM_ENGINE_START, NULL, 0, 1); }

/* Waits for the server. Returns TANDEM_ENGINE_INPUT (it acts in the next step), _STEP, _SAVE, _LOAD, _BYE, or -1. */
static inline int tandem_engine_next(tandem_engine* e) {
  uint32_t bytes = 0;
  const int type = tandem_engine_message(e, &bytes, NULL);
  const unsigned char* const body = e->body.bytes;
  if (type < 0 || type == TANDEM_ENGINE_BYE) return type;
  if (type == TANDEM_ENGINE_SAVE) {
    e->path = e->is_remote ? e->file : TANDEM_ENGINE_AT(const char*, body);
    if (e->is_remote) close(tandem_engine_make_file(e));
    return type;
  }
  if (bytes >= 8) memcpy(&e->frame, body, 8);
  if (type == TANDEM_ENGINE_LOAD && bytes > 8) {
    e->slot = 0;
    e->path = TANDEM_ENGINE_AT(const char*, body) + 8;
    return type;
  }
  if (type == TANDEM_ENGINE_STEP && bytes == 16) {
    memcpy(&e->slot, body + 8, 4);
    if (e->slot < e->slots) return type;
  }
  if (type == TANDEM_ENGINE_INPUT && bytes >= 16) {
    memcpy(&e->kind, body + 8, 4);
    memcpy(&e->count, body + 12, 4);
    e->values = TANDEM_ENGINE_AT(const double*, body + 16);
    e->bytes = body + 16;
    if ((e->kind < TANDEM_ENGINE_APPLICATION ? 8ULL : 1ULL) * e->count == bytes - 16) return type;
  }
  return tandem_engine_fail(e, "the server sent a message that this engine does not know");
}

static inline int tandem_engine_tell(tandem_engine* e, const uint32_t entry[4], const char* key, size_t key_bytes, const void* bytes) {
  unsigned char head[24 + TANDEM_ENGINE_KEY_BYTES];
  if (key_bytes > TANDEM_ENGINE_KEY_BYTES || entry[3] > TANDEM_ENGINE_BODY - 24) return -1;
  memcpy(head, &e->frame, 8), memcpy(head + 8, entry, 16);
  if (key_bytes > 0) memcpy(head + 24, key, key_bytes);
  return tandem_engine_send(e, TANDEM_ENGINE_NEWS, head, 24 + key_bytes, bytes, entry[3] - key_bytes);
}

/* Keys and events, if HELLO has the line `news keys events`: between tandem_engine_next(), which returned _STEP, and
   tandem_engine_done(), for its frame. What breaks a limit of idl/ENGINE.md the server refuses, and its log says so. -1
   without a line in e->error: it was not sent, because it is larger than a message, or the server takes no such news. */

/* Something happened that the application knows by `kind`, below 2^31; `bytes`: 1,024 at most. `slot`: of the body that it is
   about, or TANDEM_ENGINE_NO_SLOT. */
static inline int tandem_engine_broadcast(tandem_engine* e, uint32_t kind, const void* bytes, uint32_t count, uint32_t slot) {
  uint32_t entry[4];
  entry[0] = TANDEM_ENGINE_EVENT, entry[1] = kind, entry[2] = slot, entry[3] = count;
  return e->has_events ? tandem_engine_tell(e, entry, NULL, 0, bytes) : -1;
}

/* The key, 1 to 64 characters of ASCII, has this value from now on. */
static inline int tandem_engine_set_key(tandem_engine* e, const char* key, const void* value, uint32_t count) {
  const size_t bytes = strlen(key);
  uint32_t entry[4];
  if (!e->has_keys || bytes > TANDEM_ENGINE_KEY_BYTES || count > TANDEM_ENGINE_BODY) return -1;
  entry[0] = TANDEM_ENGINE_KEY, entry[1] = TANDEM_ENGINE_AS(uint32_t, bytes), entry[2] = 0;
  entry[3] = TANDEM_ENGINE_AS(uint32_t, bytes + count);
  return tandem_engine_tell(e, entry, key, bytes, value);
}

static inline int tandem_engine_remove_key(tandem_engine* e, const char* key) {
  const size_t bytes = strlen(key);
  uint32_t entry[4];
  if (!e->has_keys || bytes > TANDEM_ENGINE_KEY_BYTES) return -1;
  entry[0] = TANDEM_ENGINE_NO_KEY, entry[1] = entry[2] = 0, entry[3] = TANDEM_ENGINE_AS(uint32_t, bytes);
  return tandem_engine_tell(e, entry, key, bytes, NULL);
}

/* The columns hold the frame of the STEP. `colliding`: bodies in contact, or 0. */
static inline int tandem_engine_done(tandem_engine* e, uint32_t colliding) {
  unsigned char body[24];
  memset(body, 0, sizeof body);
  memcpy(body, &e->frame, 8), memcpy(body + 8, &e->slot, 4), memcpy(body + 12, &colliding, 4);
  return tandem_engine_answer(e, TANDEM_ENGINE_DONE, body, sizeof body, 1);
}

/* The file at e->path is written; `bytes` is its size, 0: there is nothing to save. */
static inline int tandem_engine_saved(tandem_engine* e, uint64_t bytes) {
  FILE* const file = e->is_remote ? fopen(e->file, "rb") : NULL;
  void* const data = e->is_remote ? malloc(bytes + 1) : NULL;
  int sent;
  if (!e->is_remote) return tandem_engine_answer(e, TANDEM_ENGINE_SAVED, &bytes, sizeof bytes, 0);
  if (data == NULL || file == NULL || fread(data, 1, bytes, file) != bytes) bytes = 0;
  if (file != NULL) fclose(file);
  unlink(e->file);
  sent = tandem_engine_send(e, TANDEM_ENGINE_SAVED, &bytes, sizeof bytes, data, bytes);
  free(data);
  return sent;
}

/* The file at e->path is read, and the columns hold its frame; or it is of another world, and nothing changed. */
static inline int tandem_engine_loaded(tandem_engine* e, int loaded) {
  unsigned char body[16];
  memset(body, 0, sizeof body);
  memcpy(body, &e->frame, 8);
  body[8] = loaded != 0;
  if (e->is_remote) unlink(e->file);
  return tandem_engine_answer(e, TANDEM_ENGINE_LOADED, body, sizeof body, 1);
}

/* Tells the server why this engine ends. */
static inline void tandem_engine_complain(tandem_engine* e, const char* line) {
  (void)tandem_engine_send(e, TANDEM_ENGINE_ERROR, line, strlen(line), NULL, 0);
}

#ifdef __cplusplus
}
#endif
#endif
