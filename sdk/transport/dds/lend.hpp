#pragma once
// Lends messages to Cyclone DDS as the structs that idlc generates from idl/tandem.idl.

#include <dds/dds.h>

#include <cstddef>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/fields.hpp"
#include "tandem.h"  // generated from idl/tandem.idl

namespace tandem::transport::dds {

// What idlc makes of each type. These functions have no bodies.
char* generated(const std::string&);
tandem_BodyName generated(const BodyName&);
tandem_BodyType generated(const BodyType&);
tandem_DataField generated(const DataField&);
tandem_InputDecision generated(const InputDecision&);
tandem_Parameter generated(const Parameter&);
tandem_ReplyEntry generated(const ReplyEntry&);
tandem_ReplyText generated(const ReplyText&);
tandem_SessionStream generated(const StreamMessage&);
tandem_TandemAck generated(const AckMessage&);
tandem_TandemCheckpoint generated(const CheckpointMessage&);
tandem_TandemClientStatus generated(const ClientStatusMessage&);
tandem_TandemCommand generated(const CommandMessage&);
tandem_TandemDelta generated(const DeltaMessage&);
tandem_TandemInput generated(const InputMessage&);
tandem_TandemJournal generated(const JournalMessage&);
tandem_TandemReply generated(const ReplyMessage&);
tandem_TandemScheduledInput generated(const ScheduledInputMessage&);
tandem_TandemServerStatus generated(const ServerStatusMessage&);
tandem_TandemSession generated(const SessionMessage&);
tandem_TandemSnapshot generated(const SnapshotMessage&);
tandem_TandemStandby generated(const StandbyMessage&);

template <class T>
using Generated = decltype(generated(std::declval<const T&>()));

/// Fills generated structs. A visitor of fields(): as the list has the order of the IDL, C's rules of layout
/// say where each member is. Texts, payloads and lists of numbers are lent: the structs point into the
/// message. The structs hold until the message or the lender ends.
class Lender {
 public:
  Lender() = default;
  ~Lender();
  Lender(const Lender&) = delete;
  Lender& operator=(const Lender&) = delete;

  template <class M>
  void fill(Generated<M>& into, const M& message) {
    within<Generated<M>>(reinterpret_cast<std::byte*>(&into), [&] { fields(*this, message); });
  }

  // As a visitor of fields().
  template <class T>
  void primitive(const T& value) {
    static_assert(alignof(T) == sizeof(T));
    put(&value, sizeof value, alignof(T));
  }
  void text(const std::string& value) { primitive(value.c_str()); }
  void sequence(const Bytes& values) { lend(values.data(), values.size()); }
  template <class T, class Each>
  void sequence(const std::vector<T>& values, Each&& each) {
    if constexpr (std::is_arithmetic_v<T>) {
      lend(values.data(), values.size());
    } else {
      using Element = Generated<T>;
      static_assert(alignof(Element) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);
      // More may be kept meanwhile, which moves no bytes.
      std::byte* const elements = kept_.emplace_back(values.size() * sizeof(Element)).data();
      for (std::size_t i = 0; i < values.size(); ++i)
        within<Element>(elements + i * sizeof(Element), [&] { each(values[i]); });
      lend(elements, values.size());
    }
  }
  friend void parameters(Lender& visit, const StreamParameters& values) {
    visit.sequence(list_parameters(values), [&](const Parameter& parameter) { fields(visit, parameter); });
  }

 private:
  template <class Struct, class Visits>
  void within(std::byte* into, Visits&& visits) {
    const auto outer = std::exchange(rest_, std::span(into, sizeof(Struct)));
    visits();
    TANDEM_ASSERT(rest_.size() < alignof(Struct));  // nothing but padding is left
    rest_ = outer;
  }
  /// Copies a member behind the padding that its alignment asks for.
  void put(const void* member, std::size_t size, std::size_t alignment) noexcept;
  void lend(const void* elements, std::size_t count) noexcept;

  std::span<std::byte> rest_;  // of the struct that is being filled
  std::vector<Bytes> kept_;    // elements that the structs point to
};

/// Writes without copying payloads. Returns what dds_write() returned.
template <class M>
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const M& message) {
  Lender lender;
  Generated<M> sample{};
  lender.fill(sample, message);
  return dds_write(writer, &sample);
}

}  // namespace tandem::transport::dds
