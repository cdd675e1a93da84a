/* The C client of clients_test.py. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include "tandem/tandem.h"

static int fail(const char* what) {
  fprintf(stderr, "%s: %s\n", what, tandem_error_text());
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const uint64_t frames = strtoull(argv[3], NULL, 10), inputs = strtoull(argv[4], NULL, 10);
  tandem_options options = TANDEM_OPTIONS_INIT;
  options.session = argv[1];
  options.domain = (uint32_t)strtoul(argv[2], NULL, 10);
  options.background = 0;
  tandem_client client;
  if (tandem_join(&options, &client) != TANDEM_OK) return fail("join");
  if (tandem_wait_until_playing(client, 60) != TANDEM_OK) return fail("wait until playing");
  uint64_t sent = 0, last = 0;
  tandem_status status = TANDEM_STATUS_INIT;
  for (;;) {
    if (tandem_update(client, 0.1) != TANDEM_OK) return fail("update");
    if (tandem_get_status(client, &status) != TANDEM_OK) return fail("status");
    if (status.frame != last)
      printf("%" PRIu64 ",%" PRIu64 ",%016" PRIx64 "\n", status.epoch, status.frame, status.state_hash);
    last = status.frame;
    if (status.frames_applied >= frames && status.inputs_acted == sent && sent == inputs) break;
    if (sent < inputs && status.frames_applied > sent * frames / inputs) {
      const double gravity[3] = {(double)(sent % 7) - 3, -9, 1};
      const tandem_result result = tandem_send_gravity(client, gravity, NULL);
      if (result != TANDEM_OK && result != TANDEM_NOT_READY) return fail("send");
      sent += result == TANDEM_OK;
    }
    if (status.inputs_refused + status.inputs_unknown + status.hash_mismatches + status.resyncs != 0) break;
  }
  fprintf(stderr,
          "%" PRIu64 " frames, %" PRIu64 " of %" PRIu64 " inputs acted, %" PRIu64 " mismatches, %" PRIu64
          " resyncs\n",
          status.frames_applied, status.inputs_acted, sent, status.hash_mismatches, status.resyncs);
  return status.inputs_acted == inputs && status.hash_mismatches == 0 && tandem_leave(client) == TANDEM_OK
             ? 0
             : 1;
}
