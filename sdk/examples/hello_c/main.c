/* Joins the session "default" on DDS domain 0, tilts gravity and prints where body 0 is, once a second. */
#include <stdio.h>
#include <tandem/tandem.h>
static const double gravity[3] = {3, -9, 0};
static float p[3 * 100000]; /* positions */

int main(void) {
  tandem_options options = TANDEM_OPTIONS_INIT;
  tandem_columns columns = TANDEM_COLUMNS_INIT;
  tandem_frame frame = TANDEM_FRAME_INIT;
  tandem_client client = 0;
  options.background = 0; /* everything happens in tandem_update() */
  columns.capacity = 100000;
  columns.positions = p;
  int failed = tandem_join(&options, &client) || tandem_wait_until_playing(client, 10) ||
               tandem_send_gravity(client, gravity, NULL);
  for (int line = 0; !failed && line < 5; ++line) {
    const double next = frame.frame + 30;
    do failed = tandem_update(client, 0.1) || tandem_sample(client, NULL, &columns, &frame);
    while (!failed && frame.frame < next);
    if (!failed) printf("frame %.1f: body 0 at %.2f %.2f %.2f\n", frame.frame, p[0], p[1], p[2]);
  }
  if (failed) puts(tandem_error_text());
  return tandem_leave(client) || failed;
}
