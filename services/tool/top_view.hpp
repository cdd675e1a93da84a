#pragma once
// The view of `tandem top`: the newest status of every session and client, as JSON or as a table.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "sdk/transport/messages.hpp"

namespace tandem::tool {

/// Collects status messages. Status is published once a second; a source that is silent for three seconds is
/// forgotten, so memory is bounded by the living ones. Time comes in as an argument. Not thread-safe.
class TopView {
 public:
  /// Shows only this session from now on.
  void only(std::string session) { only_ = std::move(session); }

  void update(const transport::ServerStatusMessage& status, std::int64_t now_ns);
  void update(const transport::ClientStatusMessage& status, std::int64_t now_ns);
  void forget_silent(std::int64_t now_ns);

  [[nodiscard]] bool empty() const { return streams_.empty() && clients_.empty(); }
  /// {"sessions": [...], "clients": [...]} in one line, with the fields of the status topics. A session has
  /// the sums over its streams, and "streams" with the fields of each.
  [[nodiscard]] std::string to_json() const;
  [[nodiscard]] std::string to_table() const;

 private:
  template <class M>
  struct Heard {
    M status;
    std::int64_t at_ns = 0;
  };
  [[nodiscard]] bool shown(const std::string& session) const { return !only_ || *only_ == session; }

  std::optional<std::string> only_;
  /// Name of the session, with the epoch of a server that stands by, and number of the stream.
  using StreamKey = std::pair<std::string, std::uint32_t>;
  [[nodiscard]] bool several(const std::string& session) const;
  /// The number of the client's stream, and the predictor if that stream's status was heard.
  [[nodiscard]] std::string stream_of(const transport::ClientStatusMessage& client) const;

  std::map<StreamKey, Heard<transport::ServerStatusMessage>> streams_;
  std::map<transport::ClientId, Heard<transport::ClientStatusMessage>> clients_;
};

}  // namespace tandem::tool
