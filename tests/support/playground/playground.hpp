#pragma once
// A session on the simulated network, and its clients behind tandem.h. Time passes while a caller waits.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sdk/client/api/join.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "services/host/host.hpp"
#include "tests/fault/client/wanderers.hpp"

namespace tandem::api {

/// Only one may exist at a time, because clients without a thread read its clock. All calls from one thread.
class Playground {
 public:
  static constexpr std::uint32_t kBodies = 24;

  explicit Playground(std::uint64_t seed = 1);
  ~Playground();
  Playground(const Playground&) = delete;
  Playground& operator=(const Playground&) = delete;
  Playground(Playground&&) = delete;
  Playground& operator=(Playground&&) = delete;

  /// Does what tandem_join() does, without a thread.
  tandem_result join(const tandem_options* options, tandem_client* client);
  /// A client that joined; 0 if it could not.
  tandem_client join();

  void pass(double seconds);
  void start_server();
  void stop_server();
  /// Gives the bodies other names.
  void name(std::vector<engine::BodyName> names);
  /// Keys and events of the server that serves.
  [[nodiscard]] host::NewsDesk& news() { return *host_->news(); }
  [[nodiscard]] bool serving() const { return host_ != nullptr; }
  [[nodiscard]] static client::Now now();

  std::function<void()> on_write;  ///< within each write of a client's port

 private:
  class Port;
  void tick();

  transport::simulated::Network network_;
  std::uint64_t seed_;
  Epoch epoch_ = 1000;
  std::unique_ptr<transport::ServerPort> server_port_;
  std::unique_ptr<client::Wanderers> simulation_;
  std::unique_ptr<host::Host> host_;
};

}  // namespace tandem::api
