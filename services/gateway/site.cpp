#include "services/gateway/site.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <utility>

namespace tandem::gateway {
namespace {

namespace fs = std::filesystem;

struct MediaType {
  std::string_view ending, type;
};
constexpr std::array kMediaTypes{
    MediaType{".html", "text/html; charset=utf-8"},
    MediaType{".js", "text/javascript; charset=utf-8"},
    MediaType{".mjs", "text/javascript; charset=utf-8"},
    MediaType{".css", "text/css; charset=utf-8"},
    MediaType{".json", "application/json"},
    MediaType{".map", "application/json"},
    MediaType{".webmanifest", "application/manifest+json"},
    MediaType{".wasm", "application/wasm"},
    MediaType{".svg", "image/svg+xml"},
    MediaType{".png", "image/png"},
    MediaType{".jpg", "image/jpeg"},
    MediaType{".webp", "image/webp"},
    MediaType{".ico", "image/x-icon"},
    MediaType{".woff2", "font/woff2"},
    MediaType{".txt", "text/plain; charset=utf-8"},
};

std::optional<std::string> read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) return std::nullopt;
  return bytes;
}

// Empty if it is not smaller.
std::string gzip(const std::string& bytes) {
  constexpr int kGzipWindowBits = 15 + 16;
  constexpr int kMemoryLevel = 8;
  z_stream stream{};
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipWindowBits, kMemoryLevel,
                   Z_DEFAULT_STRATEGY) != Z_OK)
    return {};
  std::string out(bytes.size(), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const bool smaller = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  out.resize(smaller ? stream.total_out : 0);
  deflateEnd(&stream);
  return out;
}

}  // namespace

std::string_view media_type(std::string_view name) {
  for (const MediaType& known : kMediaTypes) {
    if (name.ends_with(known.ending)) return known.type;
  }
  return "application/octet-stream";
}

Result<Site> Site::load(const std::string& folder) {
  Site site;
  std::size_t bytes = 0;
  std::error_code error;
  for (auto entry = fs::recursive_directory_iterator(folder, error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (entry->path().filename().string().starts_with('.')) {
      entry.disable_recursion_pending();
      continue;
    }
    if (!entry->is_regular_file() || entry->is_symlink()) continue;
    // The build packs for servers that cannot; this one does it itself, below.
    if (entry->path().extension() == ".gz") continue;
    auto content = read_file(entry->path());
    if (!content) return fail(ErrorCode::kIo, fmt::format("{}: cannot be read", entry->path().string()));
    bytes += content->size();
    if (site.files_.size() == kMaxFiles || bytes > kMaxBytes) {
      return fail(ErrorCode::kCapacity, fmt::format("{}: a viewer has at most {} files and {} MiB", folder,
                                                    kMaxFiles, kMaxBytes >> 20U));
    }
    const std::string path = '/' + fs::relative(entry->path(), folder).generic_string();
    File file{.bytes = std::move(*content), .gzip = {}, .type = media_type(path), .immutable = {}};
    file.gzip = gzip(file.bytes);
    file.immutable = path.starts_with("/assets/");  // as Vite names them
    site.files_.emplace(path, std::move(file));
  }
  if (error) return fail(ErrorCode::kIo, fmt::format("{}: {}", folder, error.message()));
  if (site.find("/") == nullptr) return fail(ErrorCode::kIo, fmt::format("{}: holds no index.html", folder));
  return site;
}

const Site::File* Site::find(std::string_view path) const {
  const auto found = files_.find(path == "/" ? std::string_view("/index.html") : path);
  return found == files_.end() ? nullptr : &found->second;
}

}  // namespace tandem::gateway
