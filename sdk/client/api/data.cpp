// Implements data of bodies of tandem.h.
#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <string_view>

#include "sdk/client/api/clients.hpp"
#include "sdk/client/api/structs.hpp"

using namespace tandem;  // what follows is C
using namespace tandem::api;

static_assert(sizeof tandem_data_field::name > kMaxDataNameBytes);
static_assert(TANDEM_DATA_RGBA == static_cast<int>(DataKind::kRgba));

namespace {

std::optional<tandem_data_field> field_at(const transport::SessionMessage& session, std::size_t index) {
  if (index >= session.data.size()) return std::nullopt;
  tandem_data_field out = TANDEM_DATA_FIELD_INIT;
  const DataField& field = session.data[index];
  out.kind = static_cast<tandem_data_kind>(field.kind);
  out.offset = static_cast<std::uint32_t>(data_record_bytes(std::span(session.data).first(index)));
  out.value_size = static_cast<std::uint32_t>(bytes_of(static_cast<DataKind>(field.kind)));
  write_text(field.name, out.name);
  return out;
}

// The part of a record that `name` means; null: all of it.
std::optional<tandem_data_field> part_of(const transport::SessionMessage& session, const char* name) {
  if (name == nullptr) {
    tandem_data_field all = TANDEM_DATA_FIELD_INIT;
    all.value_size = static_cast<std::uint32_t>(data_record_bytes(session.data));
    return all;
  }
  const auto at = std::find_if(session.data.begin(), session.data.end(),
                               [&](const DataField& field) { return field.name == name; });
  return field_at(session, static_cast<std::size_t>(at - session.data.begin()));
}

}  // namespace

tandem_result tandem_get_data_field(tandem_client client, uint32_t index, tandem_data_field* field) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (const auto checked = check_struct(field); checked != TANDEM_OK) return checked;
    return running.with_session([&](const transport::SessionMessage* session) {
      const auto found = session != nullptr ? field_at(*session, index) : std::nullopt;
      if (!found) return refuse(TANDEM_NOT_READY, "the session has fewer fields of data");
      write_struct(*found, field);
      return kOk;
    });
  });
}

tandem_result tandem_get_data(tandem_client client, const char* name, void* values, size_t capacity,
                              size_t* count, uint64_t* frame) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (values == nullptr && capacity != 0) return null_pointer("`values` is null");
    return running.with_core([&](const client::ClientCore& core) {
      const ClientTimeline* const timeline = core.holds_state() ? core.timeline() : nullptr;
      const BodyData* const data = timeline != nullptr ? timeline->data() : nullptr;
      if (data == nullptr)
        return refuse(TANDEM_NOT_READY, "the client does not play a stream with data of bodies");
      const auto part = part_of(*core.session(), name);
      if (!part) return refuse(TANDEM_INVALID_ARGUMENT, "the session has no such field of data");
      const std::size_t slots = data->ages().size(), size = part->value_size;
      if (count != nullptr) *count = slots * size;
      if (frame != nullptr) *frame = timeline->applied();
      if (capacity == 0) return kOk;
      if (capacity < slots * size) return refuse(TANDEM_CAPACITY, "the column is longer");
      auto* const to = static_cast<std::byte*>(values);
      for (Slot slot = 0; slot < slots; ++slot)
        std::memcpy(to + slot * size, data->record(slot).data() + part->offset, size);
      return kOk;
    });
  });
}
