// A viewer without a browser: the module's client on a libwebsockets client. Prints a JSON object at its end.

#include <libwebsockets.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "sdk/client/api/clock.hpp"
#include "sdk/client/client_core.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/transport/websocket/web_port.hpp"
#include "sdk/wire/client_id.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "services/program/commandline/commandline.hpp"
#include "services/program/json/json.hpp"

namespace {

using namespace tandem;

struct Options {
  int port = 0;
  std::string address = "127.0.0.1";
  std::string tls_ca;  // trusted for `localhost`; empty: no TLS
  std::string query, origin, hash_log, session = "default";
  double seconds = 0;             // since the first applied frame
  double timeout = 60;            // of everything
  double input_every_s = 0;       // a gravity and a push in turn; 0: none
  double sleep_after_s = -1;      // of playing: reads nothing any more; negative: never
  std::size_t message_bytes = 0;  // sends one message of so many zeros instead of playing
  bool once = false;              // does not connect again
};

class Viewer final : private client::CoreListener {
 public:
  explicit Viewer(const Options& options) : options_(options), core_(core_options(options), port_, this) {
    if (!options.hash_log.empty()) log_ = std::fopen(options.hash_log.c_str(), "w");
    protocols_[0] = {"tandem.4", on_event, 0, 65'536, 0, this, 0};
    lws_set_log_level(0, nullptr);
    lws_context_creation_info info{};
    info.port = CONTEXT_PORT_NO_LISTEN;
    info.protocols = protocols_.data();
    info.user = this;
    info.options = LWS_SERVER_OPTION_JUST_USE_RAW_ORIGIN;
    if (!options.tls_ca.empty()) {
      info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
      info.client_ssl_ca_filepath = options_.tls_ca.c_str();
    }
    context_ = lws_create_context(&info);
  }
  ~Viewer() override {
    lws_context_destroy(context_);
    if (log_ != nullptr) std::fclose(log_);
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  Viewer(Viewer&&) = delete;
  Viewer& operator=(Viewer&&) = delete;

  void run() {
    const std::int64_t began_ns = transport::steady_ns();
    while (!over(began_ns)) {
      if (wsi_ == nullptr && transport::steady_ns() >= connect_at_ns_) connect();
      const std::int64_t due_ns = core_.poll(client::now());
      send_inputs();
      if (wsi_ != nullptr && port_.is_connected()) lws_callback_on_writable(wsi_);
      const std::int64_t wait_ns =
          std::clamp(due_ns - transport::steady_ns(), kMillisecond, 10 * kMillisecond);
      lws_sul_schedule(
          context_, 0, &wake_, [](lws_sorted_usec_list_t*) {}, wait_ns / 1000);
      lws_service(context_, 0);
    }
  }

  [[nodiscard]] Json report() const {
    const ClientStatus status = core_.status();
    return {{"frames_applied", status.frames_applied},
            {"hash_mismatches", status.hash_mismatches},
            {"resyncs", status.resyncs},
            {"refused_messages", status.refused_messages},
            {"connections", connections_},
            {"failures", failures_},
            {"epochs", core_.statistics().epochs},
            {"join_ms", status.join_ms},
            {"latency_ms_p50", status.latency_ms_p50},
            {"round_trip_ms", status.round_trip_ms},
            {"inputs_sent", status.inputs_sent},
            {"inputs_acted", status.inputs_acted},
            {"inputs_refused", status.inputs_refused},
            {"inputs_unknown", status.inputs_unknown},
            {"role", status.role == ClientRole::kParticipant ? "participant" : "observer"},
            {"server_status", port_.server_status().has_value()},
            {"closed", closed_}};
  }

 private:
  static client::CoreOptions core_options(const Options& options) {
    client::CoreOptions core;
    core.session = options.session;
    core.id = transport::random_client_id();
    core.measure_ns = transport::steady_ns;
    return core;
  }

  [[nodiscard]] bool over(std::int64_t began_ns) const {
    const std::int64_t now_ns = transport::steady_ns();
    const std::int64_t first_ns = core_.statistics().first_applied_ns;
    if (options_.once && connections_ + failures_ > 0 && wsi_ == nullptr) return true;
    if (first_ns != 0 && static_cast<double>(now_ns - first_ns) / 1e9 >= options_.seconds) return true;
    return static_cast<double>(now_ns - began_ns) / 1e9 >= options_.timeout;
  }

  void connect() {
    const std::string path = "/tandem" + options_.query;
    lws_client_connect_info info{};
    info.context = context_;
    info.address = options_.address.c_str();
    info.host = options_.tls_ca.empty() ? info.address : "localhost";
    info.ssl_connection = options_.tls_ca.empty() ? 0 : LCCSCF_USE_SSL;
    info.port = options_.port;
    info.path = path.c_str();
    info.origin = options_.origin.empty() ? nullptr : options_.origin.c_str();
    info.protocol = info.local_protocol_name = "tandem.4";
    wsi_ = lws_client_connect_via_info(&info);
    if (wsi_ == nullptr) lost();
  }
  void lost() {
    wsi_ = nullptr;
    ++failures_;
    port_.disconnected();
    message_.clear();
    connect_at_ns_ = transport::steady_ns() + 200 * kMillisecond;
  }

  void send_inputs() {
    const auto now = client::now();
    if (options_.input_every_s <= 0 || core_.phase() != ClientPhase::kPlaying || now.steady_ns < input_at_ns_)
      return;
    input_at_ns_ = now.steady_ns + static_cast<std::int64_t>(options_.input_every_s * 1e9);
    const double x = ++inputs_ % 4 < 2 ? 1.5 : -1.5;
    if (inputs_ % 2 == 0) {
      (void)core_.send(transport::InputKind::kGravity, {x, 0, -9}, {}, now);
    } else {
      (void)core_.send(transport::InputKind::kPush, {0, 0, 0, 2, 0, 0, 1}, {}, now);
    }
  }

  void on_applied(Epoch epoch, const client::CompleteDelta& delta) override {
    if (log_ == nullptr) return;
    std::fprintf(log_, "%llu,%llu,%s\n", static_cast<unsigned long long>(epoch),
                 static_cast<unsigned long long>(delta.frame), to_hex(delta.hash).c_str());
    std::fflush(log_);
  }

  int receive(const void* in, std::size_t len) {
    const auto* const bytes = static_cast<const std::byte*>(in);
    message_.insert(message_.end(), bytes, bytes + len);
    if (lws_remaining_packet_payload(wsi_) != 0 || lws_is_final_fragment(wsi_) == 0) return 0;
    (void)port_.receive(message_);
    message_.clear();
    const std::int64_t first_ns = core_.statistics().first_applied_ns;
    if (options_.sleep_after_s >= 0 && first_ns != 0 &&
        static_cast<double>(transport::steady_ns() - first_ns) / 1e9 >= options_.sleep_after_s) {
      lws_rx_flow_control(wsi_, 0);
    }
    return 0;
  }

  int write() {
    std::optional<transport::Bytes> message;
    if (options_.message_bytes > 0) {
      if (std::exchange(sent_zeros_, true)) return 0;
      message = transport::Bytes(options_.message_bytes);
    } else {
      message = port_.next_message();
    }
    if (!message) return 0;
    std::vector<unsigned char> framed(LWS_PRE + message->size());
    std::memcpy(framed.data() + LWS_PRE, message->data(), message->size());
    if (lws_write(wsi_, framed.data() + LWS_PRE, message->size(), LWS_WRITE_BINARY) < 0) return -1;
    lws_callback_on_writable(wsi_);
    return 0;
  }

  static int on_event(lws* wsi, lws_callback_reasons reason, void* /*user*/, void* in, std::size_t len) {
    auto& self = *static_cast<Viewer*>(lws_context_user(lws_get_context(wsi)));
    switch (reason) {
      case LWS_CALLBACK_CLIENT_ESTABLISHED:
        self.wsi_ = wsi;
        ++self.connections_;
        self.port_.connected();
        lws_callback_on_writable(wsi);
        return 0;
      case LWS_CALLBACK_CLIENT_RECEIVE:
        return self.receive(in, len);
      case LWS_CALLBACK_CLIENT_WRITEABLE:
        return self.write();
      case LWS_CALLBACK_WS_PEER_INITIATED_CLOSE:
        if (len >= 2) {
          const auto* const bytes = static_cast<const unsigned char*>(in);
          self.closed_.push_back(
              {{"code", bytes[0] * 256 + bytes[1]}, {"reason", std::string(bytes + 2, bytes + len)}});
        }
        return 0;
      case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
      case LWS_CALLBACK_CLIENT_CLOSED:
        self.lost();
        return 0;
      default:
        return 0;
    }
  }

  Options options_;
  transport::WebPort port_;
  client::ClientCore core_;
  std::array<lws_protocols, 2> protocols_{};
  lws_context* context_ = nullptr;
  lws* wsi_ = nullptr;
  lws_sorted_usec_list_t wake_{};
  transport::Bytes message_;
  std::FILE* log_ = nullptr;
  int connections_ = 0, failures_ = 0, inputs_ = 0;
  std::int64_t connect_at_ns_ = 0, input_at_ns_ = 0;
  bool sent_zeros_ = false;
  Json closed_ = Json::array();
};

}  // namespace

int main(int argc, char** argv) {
  Options options;
  tandem::commandline::Program app{"A viewer of tandem-gateway for tests."};
  app.add_option("--port", options.port).required();
  app.add_option("--address", options.address);
  app.add_option("--tls-ca", options.tls_ca);
  app.add_option("--query", options.query);
  app.add_option("--origin", options.origin);
  app.add_option("--session", options.session);
  app.add_option("--hash-log", options.hash_log);
  app.add_option("--seconds", options.seconds).required();
  app.add_option("--timeout", options.timeout);
  app.add_option("--input-every", options.input_every_s);
  app.add_option("--sleep-after", options.sleep_after_s);
  app.add_option("--zeros", options.message_bytes);
  app.add_flag("--once", options.once);
  if (const auto code = app.parse(argc, argv)) return *code;
  Viewer viewer(options);
  viewer.run();
  std::printf("%s\n", viewer.report().dump().c_str());
  return 0;
}
