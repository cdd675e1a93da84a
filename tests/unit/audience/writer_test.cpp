#include "services/follow/audience/writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "sdk/web/module/web_client.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::audience {
namespace {

using client::FakeServer;
using client::kFrameNs;
using nlohmann::json;
using ::testing::HasSubstr;

/// A folder in memory, in which nothing is named before it is there.
class Memory final : public Shelf {
 public:
  Result<void> put(const std::string& path, std::span<const std::byte> bytes) override {
    if (full) return fail(ErrorCode::kIo, "the shelf is full");
    files[path].assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (path == kManifestName) check_names();
    return {};
  }
  void remove(const std::string& path) override {
    files.erase(path);
    removed.insert(path);
  }

  json manifest() const { return json::parse(files.at(kManifestName)); }
  const std::string& object(const json& row, const char* ending = ".bin") const {
    return files.at("objects/" + row.at(0).get<std::string>() + ending);
  }
  /// Those of the chapters, and then the manifest's own.
  std::vector<json> passages() const {
    std::vector<json> all;
    const json held = manifest();
    for (const json& chapter : held["chapters"]) {
      const json read = json::parse(object(chapter, ".json"));
      for (const json& passage : read["passages"]) all.push_back(passage);
    }
    for (const json& passage : held["passages"]) all.push_back(passage);
    return all;
  }

  std::map<std::string, std::string> files;
  std::set<std::string> removed;
  bool full = false;

 private:
  void check_names() const {
    const auto check = [this](const json& row, const char* ending = ".bin") {
      const auto name = row.at(0).get<std::string>();
      const auto found = files.find("objects/" + name + ending);
      ASSERT_NE(found, files.end()) << "the manifest names what is not there";
      EXPECT_EQ(found->second.size(), row.at(1).get<std::size_t>());
      EXPECT_EQ(name_of(std::as_bytes(std::span(found->second)), ObjectKind::kMessages).sha256, name);
    };
    const json held = manifest();
    for (const json& run : held["runs"]) check(run["session"]);
    for (const json& chapter : held["chapters"]) check(chapter, ".json");
    for (const json& passage : passages()) {
      check(passage["snapshot"]);
      for (const json& segment : passage["segments"]) check(segment);
    }
  }
};

std::vector<std::span<const std::byte>> messages_of(const std::string& object) {
  std::vector<std::span<const std::byte>> messages;
  auto rest = std::as_bytes(std::span(object));
  while (!rest.empty()) {
    std::uint32_t size = 0;
    for (std::size_t i = 0; i < 4; ++i) size |= std::to_integer<std::uint32_t>(rest[i]) << (8 * i);
    messages.push_back(rest.subspan(4, size));
    rest = rest.subspan(4 + size);
  }
  return messages;
}

class AudienceWriterTest : public ::testing::Test {
 protected:
  static client::CompleteDelta whole(const transport::DeltaMessage& delta) {
    return {.frame = delta.frame,
            .last_input = delta.last_input,
            .server_time_ns = delta.server_time_ns,
            .hash = delta.hash,
            .payload = delta.payload};
  }
  void join() {
    writer->add(server.session);
    writer->add_snapshot(server.frame(), server.snapshot().bytes);
    writer->turned(now_ns);
  }
  void frames(int count, std::int64_t apart_ns = kFrameNs) {
    for (int i = 0; i < count; ++i) {
      now_ns += apart_ns;
      writer->add(server.session.epoch, whole(server.advance(kWallNs + now_ns)), now_ns);
      if (writer->wants_snapshot()) writer->add_snapshot(server.frame(), server.snapshot().bytes);
      writer->turned(now_ns);
    }
  }
  void begin(const Writer::Options& options) {
    shelf = Memory();
    writer = std::make_unique<Writer>(shelf, options);
  }
  /// Another process with the same shelf, started at `began_ms` of its wall clock.
  void begin_again(Writer::Options options) {
    auto before = read_manifest(shelf.files.at(kManifestName));
    ASSERT_TRUE(before) << before.error().message;
    std::vector<std::vector<Passage>> chapters;
    if (options.keep_ns > 0) {
      for (const Chapter& chapter : before->chapters) {
        auto read = read_chapter(shelf.files.at(chapter.object.path()));
        ASSERT_TRUE(read) << read.error().message;
        chapters.push_back(std::move(*read));
      }
    }
    writer = std::make_unique<Writer>(shelf, options);
    writer->go_on(std::move(*before), std::move(chapters));
  }
  /// Has a viewer play a passage; returns the frames whose hash it found right.
  Frame play(const json& passage) const {
    web::WebClient viewer({.id = 7, .role = ClientRole::kObserver, .lead = 0, .log = {}});
    std::int64_t at_ns = 1'000'000'000;
    const auto poll = [&] { viewer.poll({at_ns += 1'000'000, at_ns}); };
    const auto give = [&](const std::string& object) {
      for (const auto message : messages_of(object)) EXPECT_TRUE(viewer.port().receive(message));
      poll();
    };
    viewer.port().connected();
    const json held = shelf.manifest();
    for (const json& run : held["runs"]) {
      if (run["run"] == passage["run"]) give(shelf.object(run["session"]));
    }
    give(shelf.object(passage["snapshot"]));
    for (const json& segment : passage["segments"]) give(shelf.object(segment));
    EXPECT_EQ(viewer.core().statistics().hash_mismatches + viewer.core().statistics().resyncs, 0U);
    return viewer.core().timeline() != nullptr ? viewer.core().timeline()->applied() : 0;
  }

  static constexpr std::int64_t kWallNs = 1'700'000'000'000'000'000;
  FakeServer server;
  Memory shelf;
  std::unique_ptr<Writer> writer = std::make_unique<Writer>(shelf, Writer::Options{.began_ms = 5});
  std::int64_t now_ns = 1'000'000'000'000;
};

TEST_F(AudienceWriterTest, APassageIsPlayedFromItsSnapshotWithTheServersHashes) {
  join();
  frames(20);
  writer->add(server.schedule(-7));
  frames(400);
  ASSERT_TRUE(writer->finish(now_ns));
  const auto passages = shelf.passages();
  ASSERT_EQ(passages.size(), 2U);
  EXPECT_EQ(passages[0]["frame"], 0);
  EXPECT_EQ(play(passages[0]), passages[1]["frame"].get<Frame>());
  EXPECT_EQ(play(passages[1]), 420U);
}

TEST_F(AudienceWriterTest, SegmentsAreASecondLongAndLeaveNoFrameOut) {
  join();
  frames(300);
  ASSERT_TRUE(writer->finish(now_ns));
  Frame frame = 0;
  std::uint64_t at_ms = 0;
  for (const json& passage : shelf.passages()) {
    EXPECT_EQ(passage["frame"], frame);
    EXPECT_EQ(passage["from_ms"], at_ms);
    for (const json& segment : passage["segments"]) {
      EXPECT_EQ(segment[2], 30);
      EXPECT_NEAR(segment[3].get<double>(), 1000, 1);
      frame += segment[2].get<Frame>();
      at_ms += segment[3].get<std::uint64_t>();
    }
  }
  EXPECT_EQ(frame, 300U);
  EXPECT_EQ(shelf.manifest()["newest_ms"], (kWallNs + now_ns) / kMillisecond);
}

TEST_F(AudienceWriterTest, TheManifestIsThereAfterTheFirstSegmentAndEndsWithTheLast) {
  join();
  frames(29);
  EXPECT_FALSE(shelf.files.contains(kManifestName));
  frames(3);
  EXPECT_EQ(shelf.manifest()["state"], "live");
  EXPECT_EQ(shelf.manifest()["number"], 1);
  EXPECT_EQ(shelf.manifest()["writer"], 5);
  ASSERT_TRUE(writer->finish(now_ns));
  EXPECT_EQ(shelf.manifest()["state"], "ended");
  EXPECT_EQ(writer->totals().frames, 32U);
}

TEST_F(AudienceWriterTest, ALaterWriterGoesOnBehindWhatIsThere) {
  join();
  frames(30 * 95 + 7);  // the last seven are lost with the process
  const auto before = shelf.passages();
  const json held = shelf.manifest();
  begin_again({.began_ms = 2});  // its wall clock was set back
  EXPECT_EQ(writer->totals().frames, 0U);
  join();
  frames(45);
  ASSERT_TRUE(writer->finish(now_ns));
  const json manifest = shelf.manifest();
  EXPECT_GT(manifest["writer"], held["writer"]) << "or nobody would take it";
  EXPECT_EQ(manifest["chapters"], held["chapters"]);
  const auto passages = shelf.passages();
  ASSERT_EQ(passages.size(), before.size() + 1);
  EXPECT_TRUE(std::equal(before.begin(), before.end(), passages.begin()));
  EXPECT_EQ(passages.back()["from_ms"], read_manifest(held.dump())->passages.back().to_ms());
  EXPECT_EQ(passages.back()["run"], 1);
  EXPECT_EQ(play(passages.front()), passages[1]["frame"].get<Frame>());
  EXPECT_EQ(play(passages.back()), server.frame());
  EXPECT_TRUE(shelf.removed.empty());
}

TEST_F(AudienceWriterTest, ALaterWriterRemovesWhatIsTooOldOfAnEarlierOne) {
  const Writer::Options options{.keep_ns = 60 * kSecond, .began_ms = 5};
  begin(options);
  join();
  frames(30 * 150);
  const std::size_t files = shelf.files.size();
  begin_again(options);
  join();
  frames(30 * 400);
  EXPECT_LE(shelf.files.size(), files + 130) << "nothing of the earlier one is forgotten there";
  EXPECT_EQ(shelf.manifest()["runs"].size(), 1U);
}

TEST_F(AudienceWriterTest, AManifestThatCannotBeReadIsRefused) {
  join();
  frames(30 * 90);
  const json good = shelf.manifest();
  EXPECT_TRUE(read_manifest(good.dump()));
  for (const auto& [change, code] :
       {std::pair{R"({"version":2})", ErrorCode::kUnsupported},
        {R"({"protocol":2})", ErrorCode::kUnsupported},
        {R"({"format":"other"})", ErrorCode::kMalformed},
        {R"({"writer":-1})", ErrorCode::kMalformed},
        {R"({"writer":9007199254740991})", ErrorCode::kMalformed},
        {R"({"newest_ms":null})", ErrorCode::kMalformed},
        {R"({"runs":[]})", ErrorCode::kMalformed},
        {R"({"passages":[]})", ErrorCode::kMalformed},
        {R"({"passages":[{"run":4294967295,"frame":0,"from_ms":0}]})", ErrorCode::kMalformed},
        {R"({"passages":[{"run":0,"frame":0,"from_ms":1e13}]})", ErrorCode::kMalformed},
        {R"({"chapters":[["../../etc/passwd",1,0,1]]})", ErrorCode::kMalformed}}) {
    json changed = good;
    changed.update(json::parse(change));
    const auto read = read_manifest(changed.dump());
    ASSERT_FALSE(read) << change;
    EXPECT_EQ(read.error().code, code) << change;
  }
  for (const auto& [first, second, taken] : {std::tuple(0U, 1U, true),
                                             {7, 0x7fffffff, true},
                                             {1, 1, false},
                                             {1, 0, false},
                                             {0, 0x80000000, false}}) {
    json changed = good;
    changed["runs"].push_back(changed["runs"][0]);
    changed["runs"][0]["run"] = first;
    changed["runs"][1]["run"] = second;
    EXPECT_EQ(read_manifest(changed.dump()).has_value(), taken) << first << ", " << second;
  }
  EXPECT_FALSE(read_manifest(good.dump().substr(0, 400)));
  EXPECT_FALSE(read_chapter("{}"));
}

TEST_F(AudienceWriterTest, WhileTheServerIsSuspendedItsLastFramesAreThere) {
  join();
  frames(40);
  writer->turned(now_ns + 2 * kSecond);
  EXPECT_EQ(shelf.passages().back()["segments"].back()[2], 10);
  // On the time line a pause is short.
  now_ns += 60 * kSecond;
  frames(30);
  EXPECT_LT(writer->manifest().passages.back().to_ms(), 4000U);
}

TEST_F(AudienceWriterTest, OldPassagesMoveIntoChaptersAndTheManifestStaysSmall) {
  join();
  frames(30 * 300);
  const std::size_t early = shelf.files.at(kManifestName).size();
  frames(30 * 300);
  const json manifest = shelf.manifest();
  EXPECT_GE(manifest["chapters"].size(), 8U);
  EXPECT_GE(manifest["passages"].size(), 2U) << "who plays the present needs no chapter";
  EXPECT_LT(shelf.files.at(kManifestName).size(), early + 800) << "for five minutes more";
  EXPECT_EQ(play(shelf.passages()[20]), shelf.passages()[21]["frame"].get<Frame>());
  EXPECT_TRUE(shelf.removed.empty());
}

TEST_F(AudienceWriterTest, WithAnAgeOldObjectsGoAfterAWhileForThoseWhoHoldAnOlderManifest) {
  begin({.keep_ns = 60 * kSecond, .began_ms = 5});
  join();
  frames(30 * 100);
  const auto first = shelf.passages().front();
  frames(30 * 45);
  EXPECT_NE(shelf.passages().front(), first);
  const std::string gone = "objects/" + first["snapshot"][0].get<std::string>() + ".bin";
  EXPECT_TRUE(shelf.files.contains(gone)) << "no sooner than a minute after the manifest";
  frames(30 * 60);
  EXPECT_FALSE(shelf.files.contains(gone));
  frames(30 * 600);
  const json manifest = shelf.manifest();
  const json oldest = shelf.passages().front();
  EXPECT_GE(writer->manifest().passages.back().to_ms() - oldest["from_ms"].get<std::uint64_t>(), 60'000U);
  EXPECT_LE(shelf.files.size(), 300U) << "one a second, of at most four minutes, and some";
}

TEST_F(AudienceWriterTest, WithASizeTheOldestGo) {
  begin({.keep_bytes = 200'000, .began_ms = 5});
  join();
  frames(30 * 400);
  EXPECT_LE(writer->totals().object_bytes, 220'000U);
  EXPECT_GE(writer->totals().object_bytes, 20'000U);
  EXPECT_FALSE(shelf.passages().empty());
}

TEST_F(AudienceWriterTest, AnotherEpochAndAGapEachBeginARunWithASnapshotOfTheirOwn) {
  join();
  frames(45);
  FakeServer other(2000);
  std::swap(server.session, other.session);
  writer->add(server.session);
  std::swap(server.session, other.session);
  writer->add(other.session.epoch, whole(other.advance(kWallNs + now_ns)), now_ns);  // no snapshot yet
  writer->add_snapshot(other.frame(), other.snapshot().bytes);
  for (int i = 0; i < 30; ++i) {
    now_ns += kFrameNs;
    writer->add(other.session.epoch, whole(other.advance(kWallNs + now_ns)), now_ns);
  }
  other.advance();  // lost
  writer->add(other.session.epoch, whole(other.advance(kWallNs + now_ns)), now_ns);
  writer->add_snapshot(other.frame(), other.snapshot().bytes);
  for (int i = 0; i < 30; ++i) {
    now_ns += kFrameNs;
    writer->add(other.session.epoch, whole(other.advance(kWallNs + now_ns)), now_ns);
  }
  ASSERT_TRUE(writer->finish(now_ns));
  const json runs = shelf.manifest()["runs"];
  ASSERT_EQ(runs.size(), 3U);
  EXPECT_EQ(runs[0]["epoch"], 1000);
  EXPECT_EQ(runs[1]["epoch"], 2000);
  EXPECT_EQ(runs[2]["epoch"], 2000);
  const auto passages = shelf.passages();
  ASSERT_EQ(passages.size(), 3U);
  EXPECT_EQ(play(passages[0]), 45U);
  EXPECT_EQ(play(passages[1]), 31U);
  EXPECT_EQ(play(passages[2]), 63U);
  EXPECT_LT(passages[2]["from_ms"], 2700) << "gaps are no part of the time line";
}

TEST_F(AudienceWriterTest, OtherNamesReachWhoBeginsLater) {
  join();
  frames(31);
  const json before = shelf.manifest()["runs"][0]["session"];
  server.session.names = {{.slot = 3, .reuse = 0, .name = "Ada"}};
  writer->add(server.session);
  frames(30);
  EXPECT_EQ(shelf.manifest()["runs"].size(), 1U);
  EXPECT_NE(shelf.manifest()["runs"][0]["session"], before);
  EXPECT_THAT(shelf.object(shelf.manifest()["runs"][0]["session"]), HasSubstr("Ada"));
}

TEST_F(AudienceWriterTest, StampsOfAClockThatIsSetDoNoHarm) {
  join();
  for (const std::int64_t stamp : {kWallNs, INT64_MIN, INT64_MAX, std::int64_t{0}, kWallNs}) {
    for (int i = 0; i < 20; ++i) {
      now_ns += kFrameNs;
      writer->add(server.session.epoch, whole(server.advance(stamp)), now_ns);
      writer->turned(now_ns);
    }
  }
  ASSERT_TRUE(writer->finish(now_ns));
  EXPECT_LE(writer->manifest().passages.back().to_ms(), 30'000U);
  EXPECT_EQ(play(shelf.passages()[0]), 100U);
}

TEST_F(AudienceWriterTest, AfterAFullDiskNothingMoreIsWrittenAndItIsSaid) {
  join();
  frames(40);
  shelf.full = true;
  frames(40);
  EXPECT_FALSE(writer->good());
  shelf.full = false;
  const auto files = shelf.files;
  frames(40);
  EXPECT_EQ(shelf.files, files);
  EXPECT_EQ(writer->finish(now_ns).error().message, "the shelf is full");
}

}  // namespace
}  // namespace tandem::audience
