// CPU of a gateway with many viewers, and the time from a DDS client's frame to theirs. Bounded: two minutes
// at most.

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "sdk/client/api/clock.hpp"
#include "sdk/client/client_core.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/client_id.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "services/program/commandline/commandline.hpp"
#include "tests/bench/gateway/crowd.hpp"

namespace tandem::bench {
namespace {

struct Options {
  std::string tandemd, gateway, relay, nats_server = "/usr/sbin/nats-server", scene = "cube";
  std::size_t viewers = 500, sleepers = 0;
  int bodies = 10'000, seconds = 20, domain = 91, nats_port = 4333;
};

/// A program that ends with this object; its output goes to a file.
class Child {
 public:
  Child(const std::vector<std::string>& command, const std::string& log) : log_(log) {
    pid_ = fork();
    if (pid_ != 0) return;
    const int fd = open(log.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
    dup2(fd, STDOUT_FILENO);
    dup2(fd, STDERR_FILENO);
    std::vector<char*> arguments;
    for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  Child(Child&&) = delete;
  Child& operator=(Child&&) = delete;
  ~Child() {
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }

  [[nodiscard]] std::string said() const {
    std::ifstream in(log_);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  /// Processor time of all its threads since its start.
  [[nodiscard]] double cpu_s() const {
    std::ifstream in("/proc/" + std::to_string(pid_) + "/stat");
    std::string word;
    for (int i = 1; i < 14; ++i) in >> word;
    double user = 0, system = 0;
    in >> user >> system;
    return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
  }
  [[nodiscard]] long resident_kb() const {
    std::ifstream in("/proc/" + std::to_string(pid_) + "/statm");
    long total = 0, resident = 0;
    in >> total >> resident;
    return resident * (sysconf(_SC_PAGESIZE) / 1024);
  }

 private:
  pid_t pid_ = 0;
  std::string log_;
};

/// A client of DDS in a thread of its own that notes when it applied each frame.
class DirectClient final : public client::CoreListener {
 public:
  DirectClient(const std::string& session, std::uint32_t domain) {
    client::CoreOptions options;
    options.session = session;
    options.id = transport::random_client_id();
    options.role = transport::Role::kObserver;
    port_ = *transport::make_dds_client_port({.domain = domain, .session = session, .client = options.id});
    core_ = std::make_unique<client::ClientCore>(options, *port_, this);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const std::int64_t wait_ns = core_->poll(client::now()) - transport::steady_ns();
        if (wait_ns > 0) port_->wait(std::chrono::nanoseconds(wait_ns));
      }
    });
  }
  [[nodiscard]] std::map<Frame, std::int64_t> applied() {
    const std::lock_guard lock(mutex_);
    return applied_ns_;
  }

 private:
  void on_applied(Epoch /*epoch*/, const client::CompleteDelta& delta) override {
    const std::lock_guard lock(mutex_);
    applied_ns_[delta.frame] = transport::steady_ns();
  }

  std::mutex mutex_;
  std::map<Frame, std::int64_t> applied_ns_;
  std::unique_ptr<transport::ClientPort> port_;
  std::unique_ptr<client::ClientCore> core_;
  std::jthread thread_;  // last: it ends first
};

double milliseconds(std::vector<std::int64_t>& sorted, double quantile) {
  if (sorted.empty()) return 0;
  return static_cast<double>(
             sorted[static_cast<std::size_t>(quantile * static_cast<double>(sorted.size() - 1))]) /
         1e6;
}

void print(const char* what, std::vector<std::int64_t>& added_ns) {
  std::ranges::sort(added_ns);
  std::printf("%s: p50 %.2f ms, p90 %.2f, p99 %.2f, most %.2f\n", what, milliseconds(added_ns, 0.5),
              milliseconds(added_ns, 0.9), milliseconds(added_ns, 0.99), milliseconds(added_ns, 1));
}

int run(const Options& options) {
  const std::string session = "bench" + std::to_string(getpid());
  const std::string domain = std::to_string(options.domain);
  const Child server({options.tandemd, "--scene", options.scene, "--bodies", std::to_string(options.bodies),
                      "--session", session, "--domain", domain, "--scripted"},
                     "/tmp/" + session + ".server");
  std::optional<Child> nats, relay;
  std::vector<std::string> from{"--domain", domain};
  if (!options.relay.empty()) {
    const std::string port = std::to_string(options.nats_port), url = "nats://127.0.0.1:" + port;
    nats.emplace(std::vector<std::string>{options.nats_server, "-a", "127.0.0.1", "-p", port},
                 "/tmp/" + session + ".nats");
    relay.emplace(std::vector<std::string>{options.relay, "--session", session, "--domain", domain, "--from",
                                           "dds", "--to", url},
                  "/tmp/" + session + ".relay");
    from = {"--from", url, "--site", "edge"};
  }
  std::vector<std::string> command{options.gateway,
                                   "--session",
                                   session,
                                   "--port",
                                   "0",
                                   "--max-viewers",
                                   std::to_string(options.viewers),
                                   "--address-connections",
                                   std::to_string(4 * options.viewers + 64),
                                   "--address-joins",
                                   std::to_string(2 * options.viewers + 64)};
  command.insert(command.end(), from.begin(), from.end());
  const Child gateway(command, "/tmp/" + session + ".gateway");
  DirectClient direct(session, static_cast<std::uint32_t>(options.domain));
  const std::int64_t give_up_ns = transport::steady_ns() + 60 * kSecond;
  while (gateway.said().find("playing") == std::string::npos && transport::steady_ns() < give_up_ns)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const std::string said = gateway.said();
  const std::size_t at = said.find("http://127.0.0.1:");
  if (at == std::string::npos || said.find("playing") == std::string::npos) {
    std::fputs(("no session within 60 s:\n" + server.said() + said).c_str(), stderr);
    return 1;
  }
  // The viewers stand for other machines, so their thread steps back for the gateway.
  const auto thread = static_cast<id_t>(gettid());
  setpriority(PRIO_PROCESS, thread, getpriority(PRIO_PROCESS, thread) + 9);
  Crowd crowd(std::stoi(said.substr(at + 17)), options.viewers, options.sleepers);
  while (crowd.playing() + options.sleepers < options.viewers && transport::steady_ns() < give_up_ns)
    crowd.run_for(100 * kMillisecond);
  crowd.run_for(2 * kSecond);
  crowd.forget_arrivals();
  const std::uint64_t gaps = crowd.gaps(), lost = crowd.lost();
  const double cpu_s = gateway.cpu_s();
  crowd.run_for(options.seconds * kSecond);
  const double cpu = (gateway.cpu_s() - cpu_s) / options.seconds;

  std::vector<std::int64_t> in_kernel_ns, read_ns;
  std::size_t frames = 0, incomplete = 0;
  const auto applied = direct.applied();
  for (const auto& [frame, arrivals] : crowd.arrivals()) {
    const auto direct_ns = applied.find(frame);
    if (direct_ns == applied.end()) continue;
    ++frames;
    incomplete += arrivals.size() < options.viewers - options.sleepers ? 1U : 0U;
    for (const Crowd::Arrival& arrival : arrivals) {
      in_kernel_ns.push_back(arrival.in_kernel_ns - direct_ns->second);
      read_ns.push_back(arrival.read_ns - direct_ns->second);
    }
  }
  std::printf(
      "%zu viewers (%zu asleep), %d bodies: %zu frames, %zu playing, %llu gaps, %llu lost, %zu frames not with all\n",
      options.viewers, options.sleepers, options.bodies, frames, crowd.playing(),
      static_cast<unsigned long long>(crowd.gaps() - gaps),
      static_cast<unsigned long long>(crowd.lost() - lost), incomplete);
  std::printf("gateway: %.1f %% of a core, %.1f MB\n", 100 * cpu,
              static_cast<double>(gateway.resident_kb()) / 1024);
  print("added until a viewer's machine has it", in_kernel_ns);
  print("added until it is read here", read_ns);
  return 0;
}

}  // namespace
}  // namespace tandem::bench

int main(int argc, char** argv) {
  tandem::bench::Options options;
  tandem::commandline::Program app{"What a gateway with many viewers costs and adds."};
  app.add_option("--tandemd", options.tandemd).required();
  app.add_option("--gateway", options.gateway).required();
  app.add_option("--relay", options.relay, "The gateway follows over NATS, behind this relay");
  app.add_option("--nats-server", options.nats_server, "With --relay").show_default();
  app.add_option("--nats-port", options.nats_port, "With --relay").show_default();
  app.add_option("--scene", options.scene).show_default();
  app.add_option("--viewers", options.viewers).show_default();
  app.add_option("--sleepers", options.sleepers).show_default();
  app.add_option("--bodies", options.bodies).show_default();
  app.add_option("--seconds", options.seconds).range(1, 60).show_default();
  app.add_option("--domain", options.domain).show_default();
  if (const auto code = app.parse(argc, argv)) return *code;
  return tandem::bench::run(options);
}
