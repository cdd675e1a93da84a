#include "services/tandemd/configuration/mistakes.hpp"

#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "services/program/configuration/file.hpp"
#include "services/tandemd/configuration/config.hpp"
#include "services/tandemd/configuration/form.hpp"
#include "services/tandemd/configuration/rehearsal.hpp"

namespace tandem::daemon {
namespace {

namespace pb = google::protobuf;

/// The number in "PATH:LINE: ...", from 1; 0 for another text.
std::size_t line_number(std::string_view message, std::string_view path) {
  if (path.empty() || !message.starts_with(path)) return 0;
  message.remove_prefix(path.size());
  if (!message.starts_with(':')) return 0;
  std::size_t number = 0;
  std::from_chars(message.data() + 1, message.data() + message.size(), number);
  return number;
}

/// The field of a line that sets one field alone, such as `bodies: 5  # many`; empty for other lines.
std::string only_field(std::string_view line) {
  std::string name;
  std::size_t colons = 0;
  char quote = 0;
  for (const char c : line) {
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '#') {
      break;
    } else if (c == '{' || c == '}' || c == '<' || c == '>' || c == '[' || c == ']') {
      return {};
    } else if (c == ':') {
      ++colons;
    } else if (colons == 0 && std::isspace(static_cast<unsigned char>(c)) == 0) {
      name += c;
    }
  }
  return colons == 1 ? name : std::string();
}

class Search {
 public:
  Search(const std::string& path, const idl::ServerConfig& flags) : path_(path), flags_(flags) {}

  std::vector<Error> run() {
    const std::optional<ConfigFile> file = path_.empty() ? ConfigFile() : read_file();
    if (file) {
      check(merge(flags_, file->config), configuration::places_beside(flags_, file->places));
      std::ranges::stable_sort(found_, {}, [this](const Error& error) {
        const std::size_t line = line_number(error.message, path_);
        return line == 0 ? SIZE_MAX : line;
      });
    }
    return std::move(found_);
  }

 private:
  /// Reads the file without the lines that cannot be read. Empty if it is not clear what they belong to.
  std::optional<ConfigFile> read_file() {
    auto text = configuration::read_text(path_);
    if (!text) {
      found_.push_back(text.error());
      return std::nullopt;
    }
    while (true) {
      auto file = parse_config(*text, path_);
      if (file) return std::move(*file);
      found_.push_back(file.error());
      if (!leave_out_line(*text, line_number(file.error().message, path_))) return std::nullopt;
    }
  }

  /// Blanks a line that sets one field. Returns false for another line.
  bool leave_out_line(std::string& text, std::size_t number) {
    if (number == 0) return false;
    std::size_t begin = 0;
    for (std::size_t i = 1; i < number && begin != std::string::npos; ++i) {
      begin = text.find('\n', begin);
      if (begin != std::string::npos) ++begin;
    }
    if (begin == std::string::npos) return false;
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string field = only_field(std::string_view(text).substr(begin, end - begin));
    if (field.empty()) return false;
    text.replace(begin, end - begin, end - begin, ' ');
    left_out_.insert(field);
    return true;
  }

  /// Takes out one wrong setting after the other.
  void check(idl::ServerConfig config, const configuration::Places& places) {
    while (true) {
      const auto good = check_config(config);
      if (!good) {
        note(good.error(), places);
        if (!take_out(config, good.error().message)) return;
        continue;
      }
      DaemonOptions options = *good;
      options.places = places;
      // With a part of the settings only the scene's name can be judged.
      const auto rehearsed = found_.empty() ? rehearse(options)
                             : has_scene_   ? check_scene(options)
                                            : Result<void>();
      if (!rehearsed) found_.push_back(rehearsed.error());
      return;
    }
  }

  /// `error` begins with its flag.
  void note(const Error& error, const configuration::Places& places) {
    const auto [field, what] = parts(error.message);
    const auto follows = [text = std::string_view(what)](const std::string& other) {
      const configuration::Setting* const setting = form().find(other);
      return setting != nullptr && text.find(setting->flag.substr(2)) != std::string::npos;
    };
    if (left_out_.contains(field) || std::ranges::any_of(left_out_, follows)) return;
    found_.push_back(placed(places, error));
  }

  /// Takes out what `message` is about, or puts a stand-in where something is missing, so that the rest can
  /// be checked. Returns false if it can do neither.
  bool take_out(idl::ServerConfig& config, const std::string& message) {
    const auto [field, what] = parts(message);
    const pb::FieldDescriptor* const described = idl::ServerConfig::descriptor()->FindFieldByName(field);
    if (described == nullptr) return false;
    auto& streams = *config.mutable_stream();
    const auto named = std::ranges::find_if(streams, [&text = what](const idl::Stream& stream) {
      return text.starts_with(stream.name() + ": ");
    });
    if (field == "stream" && named != streams.end()) {
      streams.erase(named);
      return true;
    }
    std::vector<const pb::FieldDescriptor*> set;
    config.GetReflection()->ListFields(config, &set);
    if (std::ranges::find(set, described) != set.end()) {
      left_out_.insert(field);
      config.GetReflection()->ClearField(&config, described);
      return true;
    }
    if (field == "scene") {
      config.set_scene("any");
      has_scene_ = false;
    }
    if (field == "bodies") config.set_bodies(1);
    return field == "scene" || field == "bodies";
  }

  /// Field and words of "--flag: words"; an empty field for another text.
  static std::pair<std::string, std::string> parts(const std::string& message) {
    const std::size_t colon = message.find(": ");
    if (colon == std::string::npos) return {};
    for (const configuration::Setting& setting : form().settings())
      if (setting.flag == message.substr(0, colon)) return {setting.field->name(), message.substr(colon + 2)};
    return {};
  }

  const std::string& path_;
  const idl::ServerConfig& flags_;
  std::vector<Error> found_;
  std::set<std::string> left_out_;  // fields that were set, and wrong
  bool has_scene_ = true;           // that the operator gave
};

}  // namespace

std::vector<Error> find_mistakes(const std::string& path, const idl::ServerConfig& flags) {
  return Search(path, flags).run();
}

}  // namespace tandem::daemon
