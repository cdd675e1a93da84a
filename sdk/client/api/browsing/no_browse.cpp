// "Finding sessions" of tandem.h in a library without DDS: there is no domain to look at.
#include "sdk/client/api/boundary.hpp"

using namespace tandem::api;  // what follows is C

namespace {

tandem_result no_dds() {
  return refuse(TANDEM_UNSUPPORTED, "this library was built without DDS: join by a url");
}

}  // namespace

tandem_result tandem_browser_open(uint32_t /*domain*/, tandem_browser* /*browser*/) noexcept {
  return call([] { return no_dds(); });
}

tandem_result tandem_browser_open_with(const tandem_options* /*options*/,
                                       tandem_browser* /*browser*/) noexcept {
  return call([] { return no_dds(); });
}

tandem_result tandem_browser_list(tandem_browser /*browser*/, tandem_session_info* /*sessions*/,
                                  size_t /*capacity*/, size_t* /*count*/) noexcept {
  return call([] { return no_dds(); });
}

tandem_result tandem_browser_close(tandem_browser /*browser*/) noexcept {
  return call([] { return no_dds(); });
}
