// Thousands of players of an audience without a world: each asks for the manifest and fetches every new
// segment, as sdk/web/tandem/audience does, over a connection of its own.
//
//   players --port N [--path /live/] [--players N] [--seconds S]
//
// Prints one JSON object: segments fetched a second, requests for the manifest, what was missed, and the age
// of a segment's newest frame when it was there (p50, p99, by the wall clock that this machine shares with
// the server).

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <map>
#include <memory>
#include <queue>
#include <string>
#include <string_view>
#include <vector>

#include "services/program/commandline/commandline.hpp"

namespace tandem {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kAgainMs = 970, kSoonMs = 150;  // as the player's

std::int64_t clock_ns(clockid_t which) {
  timespec now{};
  clock_gettime(which, &now);
  return std::int64_t{now.tv_sec} * 1000 * kMs + now.tv_nsec;
}
std::int64_t steady_ns() { return clock_ns(CLOCK_MONOTONIC); }

struct Segment {
  std::string name;
  std::size_t bytes = 0;
};
struct Manifest {
  std::vector<Segment> segments;
  std::int64_t newest_ms = 0;
};

/// False while the last chunk is not there.
bool join_chunks(std::string_view in, std::string& out) {
  for (;;) {
    const std::size_t line = in.find("\r\n");
    if (line == in.npos) return false;
    const std::size_t size = std::strtoull(in.data(), nullptr, 16);
    if (in.size() < line + 2 + size + 2) return false;
    if (size == 0) return true;
    out.append(in.substr(line + 2, size));
    in.remove_prefix(line + 2 + size + 2);
  }
}

/// A body that the server packed; as it is where it did not.
std::string unpacked(std::string_view body) {
  std::string out(1U << 22U, '\0');
  z_stream stream{};
  std::string in(body);
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  constexpr int kGzip = 16;
  if (inflateInit2(&stream, kGzip + MAX_WBITS) != Z_OK) return in;
  const bool whole = inflate(&stream, Z_FINISH) == Z_STREAM_END;
  out.resize(stream.total_out);
  inflateEnd(&stream);
  return whole ? out : in;
}

/// Rows of four whose first is a name: segments. The manifests are our own, so looking for them is enough.
Manifest read_manifest(std::string_view text) {
  Manifest out;
  const auto number = [&](std::size_t at) { return std::strtoll(text.data() + at, nullptr, 10); };
  if (const auto at = text.find("\"newest_ms\":"); at != text.npos) out.newest_ms = number(at + 12);
  std::size_t at = text.find("\"passages\":");
  while (at != text.npos && (at = text.find("[[\"", at)) != text.npos) {
    for (++at; at + 68 < text.size() && text[at] == '['; ++at) {
      out.segments.push_back(
          {std::string(text.substr(at + 2, 64)), static_cast<std::size_t>(number(at + 68))});
      at = text.find(']', at) + 1;
      if (at >= text.size() || text[at] != ',') break;
    }
  }
  return out;
}

struct Totals {
  std::uint64_t segments = 0, manifests = 0, unchanged = 0, missed = 0, errors = 0, bytes = 0;
  std::vector<float> ages_ms;
};

struct Player {
  int socket = -1;
  std::int64_t due_ns = 0;
  enum class Waits : std::uint8_t { kNothing, kManifest, kSegment } waits = Waits::kNothing;
  std::string etag, last;
  std::shared_ptr<const Manifest> manifest;
  std::size_t next = 0;  ///< segment of the manifest to fetch
  std::string in;
};

class Crowd {
 public:
  Crowd(std::uint16_t port, std::string path, std::size_t players)
      : path_(std::move(path)), players_(players) {
    address_.sin_family = AF_INET;
    address_.sin_port = htons(port);
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    epoll_ = epoll_create1(0);
  }

  void run(double seconds) {
    const std::int64_t began = steady_ns(), end = began + static_cast<std::int64_t>(seconds * 1e9);
    counts_from_ = began + 3000 * kMs;  // joining is not what is measured
    for (std::size_t i = 0; i < players_.size(); ++i) {
      players_[i].due_ns = began + static_cast<std::int64_t>(2e9 * static_cast<double>(i) /
                                                             static_cast<double>(players_.size()));
      due_.push({players_[i].due_ns, i});
    }
    std::array<epoll_event, 512> events{};
    while (steady_ns() < end) {
      std::int64_t now = steady_ns();
      while (!due_.empty() && due_.top().first <= now) {
        const std::size_t i = due_.top().second;
        due_.pop();
        if (players_[i].waits == Player::Waits::kNothing) ask_manifest(i);
        now = steady_ns();
      }
      const int wait_ms =
          due_.empty() ? 10
                       : static_cast<int>(std::clamp<std::int64_t>((due_.top().first - now) / kMs, 0, 10));
      const int count = epoll_wait(epoll_, events.data(), events.size(), wait_ms);
      for (int e = 0; e < count; ++e) read(events[static_cast<std::size_t>(e)].data.u64);
    }
    counted_s_ = static_cast<double>(steady_ns() - counts_from_) / 1e9;
  }

  void print() {
    std::sort(totals_.ages_ms.begin(), totals_.ages_ms.end());
    const auto quantile = [&](double q) {
      if (totals_.ages_ms.empty()) return 0.0;
      return static_cast<double>(
          totals_.ages_ms[static_cast<std::size_t>(q * static_cast<double>(totals_.ages_ms.size() - 1))]);
    };
    std::printf(
        "{\"players\": %zu, \"segments_per_s\": %.1f, \"segments_per_player_s\": %.3f, \"manifests_per_s\": %.1f, "
        "\"unchanged\": %.3f, \"missed\": %llu, \"errors\": %llu, \"mbit_per_s\": %.1f, \"age_ms\": {\"p50\": %.0f, "
        "\"p99\": %.0f}}\n",
        players_.size(), static_cast<double>(totals_.segments) / counted_s_,
        static_cast<double>(totals_.segments) / counted_s_ / static_cast<double>(players_.size()),
        static_cast<double>(totals_.manifests) / counted_s_,
        static_cast<double>(totals_.unchanged) /
            static_cast<double>(std::max<std::uint64_t>(1, totals_.manifests)),
        static_cast<unsigned long long>(totals_.missed), static_cast<unsigned long long>(totals_.errors),
        static_cast<double>(totals_.bytes) * 8 / 1048576 / counted_s_, quantile(0.5), quantile(0.99));
  }

 private:
  [[nodiscard]] bool counts() const { return steady_ns() >= counts_from_; }

  void later(std::size_t i, std::int64_t ms) {
    players_[i].waits = Player::Waits::kNothing;
    players_[i].due_ns = steady_ns() + ms * kMs;
    due_.push({players_[i].due_ns, i});
  }

  bool connect(std::size_t i) {
    Player& player = players_[i];
    if (player.socket >= 0) return true;
    player.socket = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int on = 1;
    setsockopt(player.socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    // Blocks for a moment: it is loopback, and once a player.
    fcntl(player.socket, F_SETFL, 0);
    const bool connected =
        ::connect(player.socket, reinterpret_cast<const sockaddr*>(&address_), sizeof address_) == 0;
    fcntl(player.socket, F_SETFL, O_NONBLOCK);
    if (!connected) return lose(i), false;
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = i;
    epoll_ctl(epoll_, EPOLL_CTL_ADD, player.socket, &event);
    return true;
  }
  void lose(std::size_t i) {
    ++totals_.errors;
    if (players_[i].socket >= 0) ::close(players_[i].socket);
    players_[i].socket = -1;
    players_[i].in.clear();
    later(i, 1000);
  }

  void ask(std::size_t i, const std::string& file, const std::string& more, Player::Waits waits) {
    if (!connect(i)) return;
    request_ =
        "GET " + path_ + file + " HTTP/1.1\r\nHost: audience\r\nAccept-Encoding: gzip\r\n" + more + "\r\n";
    players_[i].waits = waits;
    if (::send(players_[i].socket, request_.data(), request_.size(), MSG_NOSIGNAL) !=
        static_cast<ssize_t>(request_.size()))
      lose(i);
  }
  void ask_manifest(std::size_t i) {
    const std::string& etag = players_[i].etag;
    ask(i, "manifest.json", etag.empty() ? "" : "If-None-Match: " + etag + "\r\n", Player::Waits::kManifest);
  }
  /// The next segment, or the manifest again.
  void go_on(std::size_t i, bool was_new) {
    Player& player = players_[i];
    if (player.manifest && player.next < player.manifest->segments.size()) {
      ask(i, "objects/" + player.manifest->segments[player.next].name + ".bin", "", Player::Waits::kSegment);
    } else {
      later(i, was_new ? kAgainMs : kSoonMs);
    }
  }

  void read(std::size_t i) {
    Player& player = players_[i];
    static std::array<char, 1U << 18U> buffer;
    const ssize_t got = ::recv(player.socket, buffer.data(), buffer.size(), 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (got <= 0) return lose(i);
    if (counts()) totals_.bytes += static_cast<std::uint64_t>(got);
    player.in.append(buffer.data(), static_cast<std::size_t>(got));
    const std::size_t head = player.in.find("\r\n\r\n");
    if (head == std::string::npos) return;
    const std::string_view text = std::string_view(player.in).substr(0, head + 2);
    const int status = std::atoi(player.in.c_str() + 9);
    std::size_t size = 0;
    if (const auto at = text.find("Content-Length: "); at != text.npos && status != 304)
      size = std::strtoull(player.in.c_str() + at + 16, nullptr, 10);
    std::string_view body = std::string_view(player.in).substr(head + 4);
    std::string joined;
    if (text.find("chunked") != text.npos && status != 304) {
      if (!join_chunks(body, joined)) return;
      body = joined;
      size = joined.size();
    } else if (body.size() < size) {
      return;
    }
    if (player.waits == Player::Waits::kManifest) {
      take_manifest(i, status, text, body);
    } else {
      take_segment(i, status, size);
    }
  }

  void take_manifest(std::size_t i, int status, std::string_view head, std::string_view body) {
    Player& player = players_[i];
    if (counts()) ++totals_.manifests;
    if (status != 200 && status != 304) ++totals_.errors;
    if (status == 200) {
      if (const auto at = head.find("ETag: "); at != head.npos)
        player.etag = std::string(head.substr(at + 6, head.find('\r', at) - at - 6));
      auto& read = manifests_[player.etag];
      if (!read) read = std::make_shared<const Manifest>(read_manifest(unpacked(body)));
      if (manifests_.size() > 20)
        manifests_.erase(manifests_.begin() == manifests_.find(player.etag) ? std::next(manifests_.begin())
                                                                            : manifests_.begin());
      player.manifest = read;
      const auto& segments = read->segments;
      player.next = segments.size();
      while (player.next > 0 && segments[player.next - 1].name != player.last) --player.next;
      if (player.next == 0) {
        if (!player.last.empty() && counts()) ++totals_.missed;
        player.next = segments.empty() ? 0 : segments.size() - 1;  // begins with the newest
      }
    } else if (counts()) {
      ++totals_.unchanged;
    }
    player.in.clear();
    go_on(i, false);
  }

  void take_segment(std::size_t i, int status, std::size_t size) {
    Player& player = players_[i];
    const Segment& segment = player.manifest->segments[player.next];
    if (status != 200 || size != segment.bytes) ++totals_.errors;
    player.last = segment.name;
    if (++player.next == player.manifest->segments.size() && counts()) {
      ++totals_.segments;
      totals_.ages_ms.push_back(
          static_cast<float>(clock_ns(CLOCK_REALTIME) / kMs - player.manifest->newest_ms));
    } else if (counts()) {
      ++totals_.segments;
    }
    player.in.clear();
    go_on(i, true);
  }

  std::string path_, request_;
  std::vector<Player> players_;
  sockaddr_in address_{};
  int epoll_ = -1;
  std::int64_t counts_from_ = 0;
  double counted_s_ = 0;
  Totals totals_;
  std::map<std::string, std::shared_ptr<const Manifest>> manifests_;  ///< by ETag
  using Due = std::pair<std::int64_t, std::size_t>;
  std::priority_queue<Due, std::vector<Due>, std::greater<>> due_;
};

int run(int argc, char** argv) {
  std::uint16_t port = 0;
  std::string path = "/live/";
  std::uint32_t players = 5000;
  double seconds = 30;
  commandline::Program app("thousands of players of an audience without a world");
  app.add_option("--port", port, "Of a web server on this machine").required();
  app.add_option("--path", path, "Folder of the manifest");
  app.add_option("--players", players, "How many");
  app.add_option("--seconds", seconds, "For how long");
  if (const auto code = app.parse(argc, argv)) return *code;
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  Crowd crowd(port, path, players);
  crowd.run(seconds);
  crowd.print();
  return 0;
}

}  // namespace
}  // namespace tandem

int main(int argc, char** argv) { return tandem::run(argc, argv); }
