#include "services/follow/audience/manifest.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "services/program/json/json.hpp"

namespace tandem::audience {
namespace {

constexpr std::size_t kSizes = 16;
constexpr const char* kFormat = "tandem-audience";

Json to_json(const Object& object) { return Json::array({object.sha256, object.size_bytes}); }

Json to_json(const Passage& passage) {
  Json out = Json::object();
  out["run"] = passage.run;
  out["frame"] = passage.frame;
  out["from_ms"] = passage.from_ms;
  out["snapshot"] = to_json(passage.snapshot);
  Json& segments = out["segments"] = Json::array();
  for (const Segment& segment : passage.segments) {
    Json& row = segments.push_back(to_json(segment.object));
    row.push_back(segment.frames);
    row.push_back(segment.ms);
  }
  return out;
}

Json to_json(const std::vector<Passage>& passages) {
  Json out = Json::array();
  for (const Passage& passage : passages) out.push_back(to_json(passage));
  return out;
}

using Read = nlohmann::json;

/// Reads values and remembers whether all were there and in range.
class Fields {
 public:
  std::uint64_t whole(const Read& value, std::uint64_t most = kMaxNumber) {
    const bool good = check(value.is_number_unsigned() && value.get<std::uint64_t>() <= most);
    return good ? value.get<std::uint64_t>() : 0;
  }
  std::uint32_t count(const Read& value) { return static_cast<std::uint32_t>(whole(value, UINT32_MAX)); }
  std::uint32_t run(const Read& value) { return static_cast<std::uint32_t>(whole(value, kMaxRun)); }
  std::string text(const Read& value) {
    return check(value.is_string()) ? value.get<std::string>() : std::string();
  }
  Object object(const Read& row, ObjectKind kind) {
    Object object{.sha256 = text(at(row, 0)), .size_bytes = whole(at(row, 1)), .kind = kind};
    check(is_object_file(std::filesystem::path(object.path()).filename()) &&
          object.sha256.size() == kHexDigits);
    return object;
  }
  std::vector<Passage> passages(const Read& rows) {
    std::vector<Passage> out;
    std::uint64_t at_ms = 0;
    for (const Read& row : list(rows)) {
      Passage& passage = out.emplace_back();
      passage.run = run(of(row, "run"));
      passage.frame = whole(of(row, "frame"));
      passage.from_ms = whole(of(row, "from_ms"), kMaxMs);
      passage.snapshot = object(of(row, "snapshot"), ObjectKind::kMessages);
      check(passage.from_ms >= at_ms);
      at_ms = passage.from_ms;
      for (const Read& segment : list(of(row, "segments"))) {
        passage.segments.push_back({.object = object(segment, ObjectKind::kMessages),
                                    .frames = count(at(segment, 2)),
                                    .ms = whole(at(segment, 3), kMaxMs)});
        at_ms += passage.segments.back().ms;
        if (!check(passage.segments.back().frames > 0 && at_ms <= kMaxMs)) return out;
      }
    }
    check(!out.empty());
    return out;
  }
  const Read& list(const Read& value) {
    static const Read kNone = Read::array();
    return check(value.is_array()) ? value : kNone;
  }
  static const Read& of(const Read& value, const char* name) {
    static const Read kNone;
    const auto found = value.is_object() ? value.find(name) : value.end();
    return found != value.end() ? *found : kNone;
  }
  static const Read& at(const Read& row, std::size_t place) {
    static const Read kNone;
    return row.is_array() && place < row.size() ? row[place] : kNone;
  }
  bool check(bool good) { return good_ = good_ && good; }
  [[nodiscard]] bool good() const { return good_; }

 private:
  // A later writer counts on from these, and a page reads numbers below 2^53.
  static constexpr std::uint64_t kMaxNumber = (std::uint64_t{1} << 53U) - (std::uint64_t{1} << 32U);
  static constexpr std::uint64_t kMaxRun = UINT32_MAX / 2;
  static constexpr std::uint64_t kMaxMs = 1'000'000'000'000;  // 30 years, which fit as ns
  static constexpr std::size_t kHexDigits = 64;
  bool good_ = true;
};

tl::unexpected<Error> damaged() {
  return fail(ErrorCode::kMalformed, "it is cut short, or none of Tandem's");
}

}  // namespace

Result<Manifest> read_manifest(const std::string& text) {
  const Read json = Read::parse(text, nullptr, false);
  if (Fields::of(json, "format") != kFormat) return damaged();
  for (const auto& [member, ours] :
       {std::pair{"version", kFormatVersion}, {"protocol", transport::kProtocolVersion}}) {
    if (Fields::of(json, member) != ours)
      return fail(ErrorCode::kUnsupported, "it is of another " + std::string(member) + " than " +
                                               std::to_string(ours) + ", which this program writes");
  }
  Fields read;
  Manifest out;
  out.session = read.text(Fields::of(json, "session"));
  out.scene = read.text(Fields::of(json, "scene"));
  const Read& rate = Fields::of(json, "frame_rate_hz");
  if (read.check(rate.is_number())) out.frame_rate_hz = rate.get<double>();
  out.live = Fields::of(json, "state") == "live";
  out.writer = read.whole(Fields::of(json, "writer"));
  out.number = read.whole(Fields::of(json, "number"));
  out.newest_ms = static_cast<std::int64_t>(read.whole(Fields::of(json, "newest_ms")));
  for (const Read& row : read.list(Fields::of(json, "runs"))) {
    const std::uint32_t run = read.run(Fields::of(row, "run"));
    read.check(out.runs.empty() || run > out.runs.back().number);
    out.runs.push_back(
        {.number = run,
         .epoch = read.whole(Fields::of(row, "epoch")),
         .stream = {read.count(Fields::of(row, "stream")), read.count(Fields::of(row, "generation"))},
         .session = read.object(Fields::of(row, "session"), ObjectKind::kMessages)});
  }
  for (const Read& row : read.list(Fields::of(json, "chapters"))) {
    out.chapters.push_back({read.object(row, ObjectKind::kChapter),
                            {read.whole(Fields::at(row, 2)), read.whole(Fields::at(row, 3))}});
  }
  out.passages = read.passages(Fields::of(json, "passages"));
  read.check(!out.runs.empty());
  if (!read.good()) return damaged();
  return out;
}

Result<std::vector<Passage>> read_chapter(const std::string& text) {
  Fields read;
  std::vector<Passage> out = read.passages(Fields::of(Read::parse(text, nullptr, false), "passages"));
  if (!read.good()) return damaged();
  return out;
}

std::uint64_t Passage::to_ms() const {
  std::uint64_t end = from_ms;
  for (const Segment& segment : segments) end += segment.ms;
  return end;
}

std::string to_text(const Manifest& manifest) {
  Json out = Json::object();
  out["format"] = kFormat;
  out["version"] = kFormatVersion;
  out["protocol"] = transport::kProtocolVersion;
  out["writer"] = manifest.writer;
  out["number"] = manifest.number;
  out["state"] = manifest.live ? "live" : "ended";
  out["session"] = manifest.session;
  out["scene"] = manifest.scene;
  out["frame_rate_hz"] = manifest.frame_rate_hz;
  out["newest_ms"] = manifest.newest_ms;
  Json& runs = out["runs"] = Json::array();
  for (const Run& run : manifest.runs) {
    Json& row = runs.push_back(Json::object());
    row["run"] = run.number;
    row["epoch"] = run.epoch;
    row["stream"] = run.stream.id;
    row["generation"] = run.stream.generation;
    row["session"] = to_json(run.session);
  }
  Json& chapters = out["chapters"] = Json::array();
  for (const Chapter& chapter : manifest.chapters) {
    Json& row = chapters.push_back(to_json(chapter.object));
    row.push_back(chapter.span.from_ms);
    row.push_back(chapter.span.to_ms);
  }
  out["passages"] = to_json(manifest.passages);
  std::string text = out.dump();
  // Many servers tell two versions of a file apart by its second and its size, and two may come in a second.
  while (text.size() % kSizes != manifest.number % kSizes) text += ' ';
  return text;
}

std::string to_text(const std::vector<Passage>& passages) {
  Json out = Json::object();
  out["passages"] = to_json(passages);
  return out.dump();
}

}  // namespace tandem::audience
