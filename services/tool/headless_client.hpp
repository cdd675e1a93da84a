#pragma once
// One client of `tandem join`: plays for a while, writes logs, sends scripted inputs.

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/follow/audience/audience_sink.hpp"
#include "services/follow/following/session_client.hpp"
#include "services/follow/recording/recording_sink.hpp"
#include "services/program/json/json.hpp"
#include "services/tool/recording_port.hpp"

namespace tandem::tool {

struct HeadlessOptions {
  std::uint32_t domain = 0;
  std::string secure;        ///< folder of its identity; empty: none
  std::string profile = {};  ///< of the network; see DdsOptions
  std::string session;       ///< empty: "default", and any of a gateway
  std::string url, tls_ca;   ///< of a gateway instead of DDS; see tandem_options
  std::string token_file;    ///< empty: none
  bool observe = false;
  std::uint32_t lead = 1;
  std::optional<double> max_delay_s;            ///< see ClientOptions
  std::uint32_t max_kbit_s = 0;                 ///< on the network; 0: no cap; see tandem_options
  std::optional<double> timeout_s;              ///< until the first applied frame; empty: waits for ever
  std::optional<double> seconds;                ///< from the first applied frame; empty: until stopped
  std::string hash_log, capture, input_script;  ///< paths; empty: none
  recording::Compression compression = recording::Compression::kNone;  ///< of the capture
  bool overwrite = false;                 ///< replaces an older capture, or what is published for an audience
  std::string publish;                    ///< folder for an audience (services/follow/audience); empty: none
  audience::Writer::Options publication;  ///< of what is published
  std::string prefer = "auto";            ///< which stream to play; see CoreOptions
  bool live = false;                      ///< a JSON line a second on stderr
  /// Takes lines for humans; empty: they go to stderr, as those of `tandem join`.
  std::function<void(LogLevel level, const std::string& line)> log;
  std::uint32_t index = 0;  ///< index of this client in live lines
  std::string name;         ///< in front of lines for humans; may be empty

  /// The session to join; empty: whichever the gateway at `url` has.
  [[nodiscard]] std::string wanted_session() const {
    return session.empty() && url.empty() ? "default" : session;
  }
};

/// What a client has written of its session so far.
struct Kept {
  recording::Recorder::Progress progress;
  bool good = true;  ///< false after an error, with which the client ends
};

/// Sees a client after every turn of the client's loop.
class TurnListener {
 public:
  virtual ~TurnListener() = default;
  virtual void turned(const client::ClientCore& core, const Kept& kept, std::int64_t now_ns) = 0;
};

/// Runs in one thread of the caller.
class HeadlessClient final : private following::SessionSink {
 public:
  /// Opens its files and joins the DDS domain. Errors: kIo, kMalformed (script), kInvalidArgument,
  /// kTransport.
  static Result<std::unique_ptr<HeadlessClient>> create(const HeadlessOptions& options);
  ~HeadlessClient() override;
  HeadlessClient(const HeadlessClient&) = delete;
  HeadlessClient& operator=(const HeadlessClient&) = delete;
  HeadlessClient(HeadlessClient&&) = delete;
  HeadlessClient& operator=(HeadlessClient&&) = delete;

  /// Plays until its time is over or `stop` is set. `listener` may be null.
  void run(const std::atomic<bool>& stop, TurnListener* listener = nullptr);
  /// True if it played without a hash mismatch and all files are written.
  [[nodiscard]] bool succeeded() const;
  /// The JSON object of the result, valid after run().
  [[nodiscard]] Json report() const;
  /// The recorder of the capture, valid after run(); null without one.
  [[nodiscard]] const recording::Recorder* recorder() const { return recorder_.get(); }
  /// What was published, valid after run(); null if nothing is.
  [[nodiscard]] const audience::Writer* publication() const {
    return publication_ ? &publication_->writer() : nullptr;
  }
  /// The result in a few lines for humans.
  [[nodiscard]] std::string summary() const;

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  struct ScriptEntry {
    Frame after = 0;  ///< frames applied before it is sent
    transport::InputKind kind = transport::InputKind::kGravity;
    std::vector<double> values;
    transport::Bytes bytes;
  };

  explicit HeadlessClient(HeadlessOptions options) : options_(std::move(options)) {}
  Result<void> open();
  /// Where it looks for a session, for people.
  [[nodiscard]] std::string place() const;
  Result<void> load_script(double dt_s);
  void on_session(const transport::SessionMessage& session) override;
  void on_unplayed(const transport::SessionMessage& session) override { learn(session); }
  void on_applied(const client::CompleteDelta& delta, std::int64_t now_ns) override;
  void learn(const transport::SessionMessage& session);
  [[nodiscard]] const client::ClientCore& core() const { return client_->core(); }
  void send_script(client::Now now);
  [[nodiscard]] Kept kept() const;
  void tell_waiting(client::Now now);
  /// What to say of frames that should have come for `least_ns` or longer.
  [[nodiscard]] std::optional<std::string> missing_frames(std::int64_t now_ns, std::int64_t least_ns) const;
  void tell_missing(client::Now now);
  void tell_live(client::Now now);
  void tell(LogLevel level, const std::string& line) const;
  void finish();

  HeadlessOptions options_;
  std::unique_ptr<transport::ClientPort> port_;
  std::unique_ptr<std::FILE, Closer> hash_log_;
  std::unique_ptr<recording::Recorder> recorder_;
  std::unique_ptr<RecordingPort> recording_port_;
  std::unique_ptr<audience::Publication> publication_;
  std::unique_ptr<following::SessionClient> client_;
  std::optional<recording::RecordingSink> recording_sink_;
  std::optional<audience::AudienceSink> audience_sink_;
  std::vector<following::SessionSink*> sinks_;
  Epoch epoch_ = 0;
  std::vector<ScriptEntry> script_;
  std::size_t script_at_ = 0;

  std::int64_t started_ns_ = 0;
  std::int64_t session_ns_ = 0;  ///< when the first session was learned
  std::int64_t told_ns_ = 0, live_ns_ = 0, missing_told_ns_ = 0;
  std::uint64_t live_bytes_ = 0, live_wire_bytes_ = 0, live_frames_ = 0;
  Frame last_frame_ = 0;
  std::uint64_t last_hash_ = 0;
  std::optional<double> first_join_ms_;
  std::string failure_;
};

}  // namespace tandem::tool
