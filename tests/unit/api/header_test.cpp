// The header itself: what must not change by accident.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <string>

#include "tandem/tandem.h"

extern "C" {
size_t size_of_options_in_c(void);
size_t size_of_status_in_c(void);
size_t size_of_columns_in_c(void);
size_t size_of_event_in_c(void);
int initialisers_set_sizes_in_c(void);
}

namespace {

TEST(TheHeader, IsTheSameInCAndInCpp) {
  EXPECT_EQ(size_of_options_in_c(), sizeof(tandem_options));
  EXPECT_EQ(size_of_status_in_c(), sizeof(tandem_status));
  EXPECT_EQ(size_of_columns_in_c(), sizeof(tandem_columns));
  EXPECT_EQ(size_of_event_in_c(), sizeof(tandem_event));
  EXPECT_EQ(initialisers_set_sizes_in_c(), 1);
}

// Programs in the field hold these: they may only grow, at their end.
TEST(TheHeader, KeepsTheSizesThatWereReleased) {
  static_assert(sizeof(void*) != 8 || (sizeof(tandem_options) == 120 && sizeof(tandem_columns) == 104));
  EXPECT_EQ(sizeof(tandem_status), 760U);
  EXPECT_EQ(offsetof(tandem_status, stream_changes), 744U);
  EXPECT_EQ(offsetof(tandem_status, wire_mbit_per_s), 752U);
  EXPECT_EQ(sizeof(tandem_sample_options), 24U);
  EXPECT_EQ(sizeof(tandem_frame), 48U);
  EXPECT_EQ(sizeof(tandem_event), 304U);
  EXPECT_EQ(sizeof(tandem_news), 1152U);
  EXPECT_EQ(offsetof(tandem_news, bytes), 128U);
  EXPECT_EQ(sizeof(tandem_data_field), 56U);
  EXPECT_EQ(sizeof(tandem_scene), 192U);
  EXPECT_EQ(offsetof(tandem_scene, dt_s), 160U);
  EXPECT_EQ(sizeof(tandem_solid), 64U);
  EXPECT_EQ(sizeof(tandem_body_type), 104U);
  EXPECT_EQ(sizeof(tandem_session_info), 408U);
  EXPECT_EQ(offsetof(tandem_session_info, dt_s), 352U);
}

TEST(TheHeader, HasTheVersionOfTheLibrary) {
  EXPECT_EQ(tandem_version_number(), static_cast<uint32_t>(TANDEM_VERSION_NUMBER));
  EXPECT_STREQ(tandem_version(), TANDEM_VERSION);
}

TEST(TheHeader, EveryResultHasAName) {
  for (tandem_result result = TANDEM_OK; result <= TANDEM_INTERNAL; ++result) {
    EXPECT_EQ(std::strncmp(tandem_result_text(result), "TANDEM_", 7), 0) << result;
  }
  EXPECT_STREQ(tandem_result_text(TANDEM_INVALID_ARGUMENT), "TANDEM_INVALID_ARGUMENT");
  EXPECT_STREQ(tandem_result_text(TANDEM_CONFLICT), "TANDEM_CONFLICT");
  EXPECT_STREQ(tandem_result_text(TANDEM_OUT_OF_MEMORY), "TANDEM_OUT_OF_MEMORY");
  EXPECT_STREQ(tandem_result_text(-1), "unknown result");
  EXPECT_STREQ(tandem_result_text(INT32_MAX), "unknown result");
}

}  // namespace
