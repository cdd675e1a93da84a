// tandem.h is C99: this file is compiled as such, without extensions.
#include "tandem/tandem.h"

// How C's compiler lays out the structs.
size_t size_of_options_in_c(void) { return sizeof(tandem_options); }
size_t size_of_status_in_c(void) { return sizeof(tandem_status); }
size_t size_of_columns_in_c(void) { return sizeof(tandem_columns); }
size_t size_of_event_in_c(void) { return sizeof(tandem_event); }

int initialisers_set_sizes_in_c(void) {
  const tandem_options options = TANDEM_OPTIONS_INIT;
  const tandem_status status = TANDEM_STATUS_INIT;
  const tandem_sample_options sample_options = TANDEM_SAMPLE_OPTIONS_INIT;
  const tandem_columns columns = TANDEM_COLUMNS_INIT;
  const tandem_frame frame = TANDEM_FRAME_INIT;
  const tandem_event event = TANDEM_EVENT_INIT;
  const tandem_news news = TANDEM_NEWS_INIT;
  const tandem_data_field field = TANDEM_DATA_FIELD_INIT;
  const tandem_scene scene = TANDEM_SCENE_INIT;
  const tandem_solid solid = TANDEM_SOLID_INIT;
  const tandem_body_type type = TANDEM_BODY_TYPE_INIT;
  const tandem_session_info session = TANDEM_SESSION_INFO_INIT;
  return options.size == sizeof options && status.size == sizeof status &&
         sample_options.size == sizeof sample_options && columns.size == sizeof columns &&
         frame.size == sizeof frame && event.size == sizeof event && news.size == sizeof news &&
         field.size == sizeof field &&
         scene.size == sizeof scene && solid.size == sizeof solid && type.size == sizeof type &&
         session.size == sizeof session;
}
