#include "services/audience/manifest.hpp"

#include "services/json/json.hpp"

namespace tandem::audience {
namespace {

constexpr std::size_t kSizes = 16;

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

}  // namespace

std::uint64_t Passage::to_ms() const {
  std::uint64_t end = from_ms;
  for (const Segment& segment : segments) end += segment.ms;
  return end;
}

std::string to_text(const Manifest& manifest) {
  Json out = Json::object();
  out["format"] = "tandem-audience";
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
