// The test vectors of idl/vectors, which an implementation of the protocol in another language wrote: every
// hash is computed, every refusal happens.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "sdk/core/data/data_section.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/core/timeline/input_schedule.hpp"
#include "sdk/core/timeline/parts.hpp"
#include "sdk/core/timeline/snapshot.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::byte>;

/// A key of a vector file and the words of its value.
struct Entry {
  std::string key;
  std::vector<std::string> words;
  std::size_t line = 0;
};

std::vector<Entry> read_entries(const fs::path& path) {
  std::ifstream in(path);
  std::vector<Entry> entries;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    line = line.substr(0, line.find('#'));
    std::istringstream words(line);
    std::string word;
    if (!line.empty() && line[0] != ' ' && words >> word) entries.push_back({word, {}, number});
    while (words >> word) entries.back().words.push_back(word);
  }
  return entries;
}

std::int64_t number(const std::string& word) { return std::stoll(word); }

std::vector<std::int32_t> numbers(std::span<const std::string> words) {
  std::vector<std::int32_t> all;
  for (const std::string& word : words) all.push_back(static_cast<std::int32_t>(number(word)));
  return all;
}

Bytes hex(const std::vector<std::string>& words) {
  std::string digits;
  for (const std::string& word : words) digits += word;
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    bytes.push_back(static_cast<std::byte>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  return bytes;
}

Drive drive_of(std::span<const std::string> words) {
  Drive drive;
  for (std::size_t i = 0; i < 3; ++i) drive.gravity[i] = static_cast<std::int32_t>(number(words[i]));
  drive.damping = static_cast<std::uint16_t>(number(words[3]));
  return drive;
}

std::optional<Layout> layout_of(const std::map<std::string, std::vector<std::string>>& header) {
  Layout layout;
  for (const auto& [key, words] : header) {
    if (key == "capacity") layout.capacity = static_cast<std::uint32_t>(number(words[0]));
    if (key == "types") layout.type_count = static_cast<TypeId>(number(words[0]));
    if (key == "lead") layout.lead = static_cast<std::uint32_t>(number(words[0]));
    if (key == "codec") layout.codec = words[0];
    if (key == "codec_tables") layout.codec_tables = hex(words);
    if (key == "predictor") layout.predictor = words[0];
    if (key == "predictor_constants") layout.predictor_constants = numbers(words);
    if (key == "radii") layout.radii = numbers(words);
    if (key == "groups") layout.groups = words;
    if (key == "data") {
      for (const std::string& word : words) {
        const std::size_t at = word.find(':');
        const auto kind = data_kind(word.substr(at + 1));
        if (!kind) return std::nullopt;
        layout.data.push_back({static_cast<std::uint32_t>(*kind), word.substr(0, at)});
      }
    }
    if (key == "features") {
      const auto has = [&words](const char* word) { return std::ranges::find(words, word) != words.end(); };
      layout.world = {.keys = has("keys"), .events = has("events")};
    }
    if (key == "parameters") {
      std::vector<Parameter> list;
      for (const auto& word : words) {
        const std::size_t at = word.find('=');
        list.push_back({static_cast<std::uint32_t>(number(word.substr(0, at))),
                        static_cast<std::int32_t>(number(word.substr(at + 1)))});
      }
      const auto parameters = parameters_from(list);
      if (!parameters) return std::nullopt;
      layout.parameters = *parameters;
    }
  }
  return layout;
}

Result<TimelineParts> parts_of(const Layout& layout) {
  auto predictor = make_predictor(layout.predictor, layout.capacity, layout.predictor_constants);
  if (!predictor) return tl::unexpected<Error>(predictor.error());
  return make_parts(layout, {}, std::move(*predictor));
}

/// A stream as a vector tells it: unlike a timeline, it may be asked for any step in any order.
class Replica {
 public:
  Replica(const Layout& layout, TimelineParts parts)
      : layout_(layout), parts_(std::move(parts)), state_(layout.capacity, groups_of(layout)) {
    state_.keep_for_predictor(parts_.predictor->own_bytes());
  }

  void start(const Drive& drive, Frame frame, std::span<const std::string> bodies) {
    drive_ = drive;
    frame_ = frame;
    const bool turns = state_.groups().orientation;
    const std::size_t width = turns ? 20 : 13;
    for (std::size_t at = 0; at + width <= bodies.size(); at += width) {
      const std::vector<std::int32_t> n = numbers(bodies.subspan(at, width));
      const auto slot = static_cast<Slot>(n[0]);
      BodyState body{{n[4], n[5], n[6]}, {n[7], n[8], n[9]}};
      if (turns) {
        body.q = {n[13], n[14], n[15], n[16]};
        body.w = {n[17], n[18], n[19]};
      }
      state_.spawn(slot, static_cast<std::uint8_t>(n[1]), static_cast<TypeId>(n[2]), body);
      state_.rest()[slot] = static_cast<std::uint8_t>(n[3]);
      for (std::size_t i = 0; i < 3; ++i) state_.c(i)[slot] = n[10 + i];
    }
    started_ = true;
  }
  bool predict(std::int64_t steps) {
    for (; steps > 0; --steps) {
      ++frame_;
      const Vec3i gravity_before = drive_.gravity;
      drive_ = inputs_.drive_for(frame_, drive_);
      inputs_.forget(frame_);
      parts_.predictor->step(state_, state_, parts_.step_input(drive_, gravity_before));
    }
    return true;
  }
  bool delta(const Bytes& payload) {
    parts_.delta.set_gravity(drive_.gravity);
    News news;
    const auto rest = read_news(payload, layout_.world, layout_.capacity, news);
    if (!rest || (parts_.world && !parts_.world->check(news))) return false;
    std::span<const std::byte> bodies = *rest;
    Result<std::optional<std::span<const std::byte>>> data = std::nullopt;
    if (parts_.data) data = take_data(bodies);
    if (!data) return false;
    const auto decoded = parts_.delta.decode(state_, bodies);
    if (!decoded) return false;
    if (parts_.data) {
      std::vector<std::uint8_t> alive;
      list_living(state_.alive(), decoded->lifecycle, alive);
      parts_.data->keep();
      if (*data && !parts_.data->decode(**data, {alive, decoded->lifecycle})) return false;
      parts_.data->apply({alive, decoded->lifecycle});
    }
    parts_.delta.apply(*decoded, state_);
    if (parts_.world) parts_.world->apply(news);
    return true;
  }
  bool input(const std::vector<std::string>& words) {
    return inputs_
        .add({static_cast<std::uint64_t>(number(words[0])), static_cast<Frame>(number(words[1])),
              drive_of(std::span(words).subspan(2))},
             frame_)
        .has_value();
  }
  /// The first is loaded; a later one holds what there is now.
  bool snapshot(const Bytes& bytes) {
    State state(layout_.capacity, groups_of(layout_));
    auto fresh = parts_of(layout_);
    state.keep_for_predictor(fresh->predictor->own_bytes());
    const auto read = read_snapshot(bytes, layout_.type_count, state, fresh->delta.codec(), layout_.world,
                                    fresh->data ? &*fresh->data : nullptr);
    if (!read) return false;
    fresh->world = read->world;
    if (hash_of(*fresh, state) != read->hash || fresh->hasher.leaves_hash() != read->leaves_hash)
      return false;
    if (started_) {
      EXPECT_EQ(state, state_);
      EXPECT_EQ(read->frame, frame_);
      EXPECT_EQ(read->hash, hash_of(parts_, state_));
      EXPECT_EQ(synthetic::coder_state(fresh->delta.codec()), synthetic::coder_state(parts_.delta.codec()));
      return true;
    }
    parts_ = std::move(*fresh);
    parts_.delta.restore_parameters(read->parameters);
    inputs_.reset(read->last_input, read->pending);
    state_ = state;
    drive_ = read->drive;
    frame_ = read->frame;
    return started_ = true;
  }
  std::string hash() { return to_hex(hash_of(parts_, state_)); }

 private:
  // Of the whole state: nothing is known of its blocks.
  static std::uint64_t hash_of(TimelineParts& parts, const State& state) {
    BlockLedger ledger(state.capacity());
    ledger.renew_all(parts.new_number());
    return parts.hash(state, ledger);
  }

  Layout layout_;
  TimelineParts parts_;
  State state_;
  Drive drive_;
  InputSchedule inputs_;
  Frame frame_ = 0;
  bool started_ = false;
};

/// q and w, then q turned by w.
void check_turn(const std::vector<std::string>& words) {
  const std::vector<std::int32_t> n = numbers(words);
  ASSERT_EQ(n.size(), 11U);
  const Quaternion q{n[0], n[1], n[2], n[3]};
  const Spin w{n[4], n[5], n[6]};
  EXPECT_TRUE(valid_quaternion(q));
  EXPECT_TRUE(valid_spin(w));
  EXPECT_EQ(turned(q, w), (Quaternion{n[7], n[8], n[9], n[10]}));
}

class Vectors : public testing::TestWithParam<std::string> {};

TEST_P(Vectors, AgreeToTheBit) {
  const std::vector<Entry> entries = read_entries(fs::path(TANDEM_VECTORS_DIR) / GetParam());
  if (entries.front().key == "turn") {
    for (const Entry& entry : entries) {
      SCOPED_TRACE(testing::Message() << "line " << entry.line);
      ASSERT_EQ(entry.key, "turn");
      check_turn(entry.words);
    }
    return;
  }
  static const std::vector<std::string> kSteps{"predict", "delta", "input", "snapshot", "hash", "refuse"};
  const auto first = std::find_if(entries.begin(), entries.end(), [](const Entry& entry) {
    return std::find(kSteps.begin(), kSteps.end(), entry.key) != kSteps.end();
  });
  std::map<std::string, std::vector<std::string>> header;
  for (auto at = entries.begin(); at != first; ++at) header[at->key] = at->words;
  const auto layout = layout_of(header);
  ASSERT_TRUE(layout);
  if (header.contains("layout_hash")) {
    const std::uint64_t unit = std::stoull(header["lattice_unit"][0], nullptr, 16);
    EXPECT_EQ(to_hex(layout_hash(*layout, 4, unit)), header["layout_hash"][0]);
  }
  auto parts = parts_of(*layout);
  ASSERT_TRUE(parts) << parts.error().message;
  Replica replica(*layout, std::move(*parts));
  if (first != entries.end() && first->key != "snapshot") {
    const auto drive = header.contains("drive") ? drive_of(header["drive"]) : Drive{};
    replica.start(drive, header.contains("frame") ? static_cast<Frame>(number(header["frame"][0])) : 0,
                  header["bodies"]);
  }
  bool accepted = true;
  for (auto at = first; at != entries.end(); ++at) {
    SCOPED_TRACE(testing::Message() << "line " << at->line);
    if (at->key == "predict") accepted = replica.predict(at->words.empty() ? 1 : number(at->words[0]));
    if (at->key == "delta") accepted = replica.delta(hex(at->words));
    if (at->key == "input") accepted = replica.input(at->words);
    if (at->key == "snapshot") accepted = replica.snapshot(hex(at->words));
    if (at->key == "refuse") {
      EXPECT_FALSE(accepted);
    }
    if (at->key == "hash") {
      EXPECT_TRUE(accepted);
      ASSERT_EQ(replica.hash(), at->words[0]);
    }
  }
}

std::vector<std::string> vector_files() {
  std::vector<std::string> names;
  for (const auto& file : fs::directory_iterator(TANDEM_VECTORS_DIR)) {
    if (file.path().extension() == ".txt") names.push_back(file.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

INSTANTIATE_TEST_SUITE_P(Files, Vectors, testing::ValuesIn(vector_files()),
                         [](const auto& file) { return file.param.substr(0, file.param.find('.')); });

}  // namespace
}  // namespace tandem
