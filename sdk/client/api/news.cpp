// Implements keys and events of a session of tandem.h.
#include <algorithm>
#include <cstring>
#include <iterator>
#include <string_view>

#include "sdk/client/api/clients.hpp"
#include "sdk/client/api/structs.hpp"

using namespace tandem;  // what follows is C
using namespace tandem::api;

static_assert(sizeof tandem_news::bytes == kMaxEventBytes && sizeof tandem_news::key > kMaxKeyBytes);

tandem_result tandem_next_news(tandem_client client, tandem_news* news) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (const auto checked = check_struct(news); checked != TANDEM_OK) return checked;
    const auto next = running.next_news();
    if (!next) return refuse(TANDEM_NOT_READY, "no news");
    tandem_news out = TANDEM_NEWS_INIT;
    out.what = next->what;
    out.epoch = next->epoch;
    out.frame = next->frame;
    out.number = next->number;
    out.kind = next->kind;
    if (next->body) {
      out.has_body = 1;
      out.slot = next->body->slot;
      out.reuse = next->body->reuse;
    }
    out.gone = next->gone ? 1 : 0;
    out.byte_count = static_cast<std::uint32_t>(next->value_size);
    write_text(next->key, out.key);
    std::memcpy(out.bytes, next->bytes.data(), std::min(next->bytes.size(), sizeof out.bytes));
    write_struct(out, news);
    return kOk;
  });
}

tandem_result tandem_get_key(tandem_client client, const char* key, void* value, size_t capacity,
                             size_t* count) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (key == nullptr) return null_pointer("`key` is null");
    if (value == nullptr && capacity != 0) return null_pointer("`value` is null");
    return running.with_core([&](const client::ClientCore& core) {
      const auto known = core.keys().find(std::string_view(key));
      if (known == core.keys().end()) return refuse(TANDEM_NOT_READY, "the session has no such key");
      const std::size_t size = known->second.size();
      if (capacity != 0) std::memcpy(value, known->second.data(), std::min(size, capacity));
      if (count != nullptr) *count = size;
      if (capacity != 0 && capacity < size) return refuse(TANDEM_CAPACITY, "the value is longer");
      return kOk;
    });
  });
}

tandem_result tandem_get_key_name(tandem_client client, uint32_t index, char* key, size_t size) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (key == nullptr || size == 0) return null_pointer("`key` has no room");
    return running.with_core([&](const client::ClientCore& core) {
      if (index >= core.keys().size()) return refuse(TANDEM_NOT_READY, "the session has fewer keys");
      write_text(std::next(core.keys().begin(), index)->first, key, size);
      return kOk;
    });
  });
}
