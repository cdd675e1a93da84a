// Implements "Finding sessions" of tandem.h.
#include <algorithm>
#include <cstddef>
#include <iterator>

#include "sdk/client/api/boundary.hpp"
#include "sdk/client/api/browsing/browsers.hpp"
#include "sdk/client/api/structs.hpp"
#include "sdk/wire/clock.hpp"

namespace tandem::api {
namespace {

// The registry of browsers. It is never destroyed, so that a static object can still close its browser.
Registry<Browser>& browsers() {
  static auto* const all = new Registry<Browser>;
  return *all;
}

tandem_result no_browser() { return refuse(TANDEM_INVALID_HANDLE, "no such browser, or it was closed"); }

tandem_session_info describe(const FoundSession& found) {
  const transport::SessionMessage& s = found.announced;
  tandem_session_info out = TANDEM_SESSION_INFO_INIT;
  out.epoch = s.epoch;
  out.capacity = s.capacity;
  out.bodies = found.status.bodies;
  out.participants = found.status.participants;
  out.observers = found.status.observers;
  out.frame_rate_hz = s.frame_rate_hz;
  out.mbit_per_s = found.status.mbit_per_s;
  out.protocol_version = s.protocol_version;
  out.dt_s = s.dt_s;
  std::copy(s.gravity.begin(), s.gravity.end(), std::begin(out.gravity));
  out.up_axis = static_cast<std::uint32_t>(s.up_axis);
  out.continues_epoch = s.continues_epoch;
  out.continues_frame = s.continues_frame;
  write_text(s.session, out.name);
  write_text(s.scene, out.scene);
  if (found.stream != nullptr) {
    out.playable = 1;
    out.client_ms = found.stream->client_cost_ns * 1e-6 * s.capacity;
    write_text(found.stream->layout.codec, out.codec);
    write_text(found.stream->layout.predictor, out.predictor);
  }
  return out;
}

}  // namespace

tandem_result browse_over(std::unique_ptr<transport::Monitor> monitor, tandem_browser* browser) noexcept {
  return call([&] {
    if (browser == nullptr) return null_pointer("`browser` is null");
    *browser = browsers().add(std::make_unique<Browser>(std::move(monitor)));
    return kOk;
  });
}

}  // namespace tandem::api

using namespace tandem;  // what follows is C
using namespace tandem::api;

tandem_result tandem_browser_open(uint32_t domain, tandem_browser* browser) noexcept {
  tandem_options options = TANDEM_OPTIONS_INIT;
  options.domain = domain;
  return tandem_browser_open_with(&options, browser);
}

tandem_result tandem_browser_open_with(const tandem_options* options, tandem_browser* browser) noexcept {
  return call([&] {
    if (browser == nullptr) return null_pointer("`browser` is null");
    if (in_forked_child()) return forked_child();
    tandem_options ours = TANDEM_OPTIONS_INIT;
    if (options != nullptr) {
      if (const auto read = read_struct(options, ours); read != TANDEM_OK) return read;
    }
    transport::DdsOptions dds;
    dds.domain = ours.domain;
    if (ours.profile != nullptr) dds.profile = ours.profile;
    if (ours.secure != nullptr) dds.secure = ours.secure;
    auto monitor = transport::make_dds_monitor(dds);
    if (!monitor) return refuse(monitor.error());
    return browse_over(std::move(*monitor), browser);
  });
}

tandem_result tandem_browser_list(tandem_browser browser, tandem_session_info* sessions, size_t capacity,
                                  size_t* count) noexcept {
  return call([&] {
    const auto found = browsers().find(browser);
    if (!found) return no_browser();
    if (capacity != 0) {
      if (const auto checked = check_struct(sessions); checked != kOk) return checked;
    }
    const std::size_t size = capacity != 0 ? size_of(sessions) : 0;
    auto* const first = reinterpret_cast<std::byte*>(sessions);
    std::size_t all = 0;
    found->list(transport::steady_ns(), [&](const FoundSession& session) {
      if (all < capacity) write_struct(describe(session), first + all * size, size);
      ++all;
    });
    if (count != nullptr) *count = all;
    if (capacity != 0 && capacity < all) return refuse(TANDEM_CAPACITY, "there are more sessions");
    return kOk;
  });
}

tandem_result tandem_browser_close(tandem_browser browser) noexcept {
  return call([&] {
    const auto closed = browsers().remove(browser, [](Browser& /*ending*/) {});
    return closed != nullptr ? kOk : no_browser();
  });
}
