#include "services/lab/bandwidth/peers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#ifdef TANDEM_HAVE_ZSTD
#include <zstd.h>
#endif
#ifdef TANDEM_HAVE_ZFP
#include <zfp.h>
#endif
#ifdef TANDEM_HAVE_DRACO
#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/core/decoder_buffer.h>
#include <draco/core/encoder_buffer.h>
#include <draco/point_cloud/point_cloud.h>
#endif

namespace tandem::lab {
namespace {

using Columns = std::array<std::vector<double>, 3>;

Columns columns_of(std::uint32_t bodies) {
  Columns columns;
  for (auto& column : columns) column.assign(bodies, 0.0);
  return columns;
}

double off_squared(const Columns& seen, const engine::Bodies& bodies, std::size_t body) {
  double squared = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double off = seen[k][body] - double{bodies.position[k][body]};
    squared += off * off;
  }
  return squared;
}

/// Dead reckoning (IEEE 1278.1): both sides extrapolate; a body that is off by more than the threshold is
/// corrected. A correction counts 24 bytes, whatever it holds; the body's name is not counted.
class DeadReckoning : public Peer {
 public:
  DeadReckoning(const PeerSetting& setting, bool second_order)
      : setting_(setting),
        second_order_(second_order),
        position_(columns_of(setting.bodies)),
        velocity_(columns_of(setting.bodies)),
        acceleration_(columns_of(setting.bodies)),
        last_velocity_(columns_of(setting.bodies)) {}

  Result<std::size_t> send(const engine::Bodies& bodies, Columns& seen) override {
    constexpr std::size_t kCorrectionBytes = 24;
    std::size_t corrections = 0;
    for (std::size_t body = 0; body < setting_.bodies; ++body) {
      if (bodies.alive[body] == 0) continue;
      extrapolate(body);
      if (first_ || off_squared(position_, bodies, body) > setting_.threshold * setting_.threshold) {
        correct(bodies, body);
        ++corrections;
      }
      for (std::size_t k = 0; k < 3; ++k) {
        seen[k][body] = position_[k][body];
        last_velocity_[k][body] = double{bodies.velocity[k][body]};
      }
    }
    first_ = false;
    return corrections * kCorrectionBytes;
  }

 private:
  void extrapolate(std::size_t body) {
    const double dt = setting_.dt_s;
    for (std::size_t k = 0; k < 3; ++k) {
      position_[k][body] += velocity_[k][body] * dt + 0.5 * acceleration_[k][body] * dt * dt;
      velocity_[k][body] += acceleration_[k][body] * dt;
    }
  }
  void correct(const engine::Bodies& bodies, std::size_t body) {
    for (std::size_t k = 0; k < 3; ++k) {
      position_[k][body] = double{bodies.position[k][body]};
      velocity_[k][body] = double{bodies.velocity[k][body]};
      if (second_order_ && !first_)
        acceleration_[k][body] = (velocity_[k][body] - last_velocity_[k][body]) / setting_.dt_s;
    }
  }

  PeerSetting setting_;
  bool second_order_;
  bool first_ = true;
  Columns position_, velocity_, acceleration_, last_velocity_;
};

std::unique_ptr<Peer> make_first_order(const PeerSetting& setting) {
  return std::make_unique<DeadReckoning>(setting, false);
}
std::unique_ptr<Peer> make_second_order(const PeerSetting& setting) {
  return std::make_unique<DeadReckoning>(setting, true);
}

#ifdef TANDEM_HAVE_ZSTD
/// Positions on the coarsest lattice that keeps to the threshold; the change of each since the last frame,
/// as two's complement in four planes of bytes, which zstd compresses better than whole numbers.
class Zstd : public Peer {
 public:
  explicit Zstd(const PeerSetting& setting)
      : bodies_(setting.bodies),
        step_(2 * setting.threshold / std::sqrt(3.0)),
        planes_(std::size_t{setting.bodies} * 12),
        out_(ZSTD_compressBound(planes_.size())),
        context_(ZSTD_createCCtx(), &ZSTD_freeCCtx) {
    for (auto& column : last_) column.assign(bodies_, 0);
  }

  Result<std::size_t> send(const engine::Bodies& bodies, Columns& seen) override {
    constexpr int kLevel = 3;  // zstd's own default
    const std::size_t count = std::size_t{bodies_} * 3;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t body = 0; body < bodies_; ++body) {
        if (bodies.alive[body] == 0) continue;
        const std::int64_t now = std::llround(double{bodies.position[k][body]} / step_);
        const auto change = static_cast<std::uint32_t>(now - last_[k][body]);
        for (std::size_t plane = 0; plane < 4; ++plane)
          planes_[plane * count + k * bodies_ + body] = static_cast<std::uint8_t>(change >> (8 * plane));
        last_[k][body] = now;
        seen[k][body] = static_cast<double>(now) * step_;
      }
    }
    const std::size_t size =
        ZSTD_compressCCtx(context_.get(), out_.data(), out_.size(), planes_.data(), planes_.size(), kLevel);
    if (ZSTD_isError(size) != 0) return fail(ErrorCode::kUnsupported, ZSTD_getErrorName(size));
    return size;
  }

 private:
  std::size_t bodies_;
  double step_;
  std::array<std::vector<std::int64_t>, 3> last_;
  std::vector<std::uint8_t> planes_, out_;
  std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> context_;
};
std::unique_ptr<Peer> make_zstd(const PeerSetting& setting) { return std::make_unique<Zstd>(setting); }
#else
constexpr std::unique_ptr<Peer> (*make_zstd)(const PeerSetting&) = nullptr;
#endif

#ifdef TANDEM_HAVE_ZFP
/// The change since what the receiver holds, one array per axis, in zfp's fixed-accuracy mode. zfp stays far
/// below a tolerance, so it gets the largest that keeps the frame within the threshold.
class Zfp : public Peer {
 public:
  explicit Zfp(const PeerSetting& setting)
      : setting_(setting), held_(columns_of(setting.bodies)), next_(held_), change_(setting.bodies) {}

  Result<std::size_t> send(const engine::Bodies& bodies, Columns& seen) override {
    const double guaranteed = setting_.threshold / std::sqrt(3.0);
    for (double tolerance = 16 * guaranteed;; tolerance /= 2) {
      auto size = pack(bodies, tolerance);
      if (!size) return size;
      if (tolerance > guaranteed && !within(bodies)) continue;
      held_ = seen = next_;
      return size;
    }
  }

 private:
  [[nodiscard]] bool within(const engine::Bodies& bodies) const {
    for (std::size_t body = 0; body < setting_.bodies; ++body) {
      if (bodies.alive[body] == 0) continue;
      if (off_squared(next_, bodies, body) > setting_.threshold * setting_.threshold) return false;
    }
    return true;
  }
  /// The bytes of a frame; next_ becomes what a receiver would hold.
  Result<std::size_t> pack(const engine::Bodies& bodies, double tolerance) {
    std::size_t size = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t body = 0; body < setting_.bodies; ++body)
        change_[body] = bodies.alive[body] == 0 ? 0 : double{bodies.position[k][body]} - held_[k][body];
      const auto packed = pack_changes(tolerance);
      if (!packed) return packed;
      size += *packed;
      for (std::size_t body = 0; body < setting_.bodies; ++body)
        next_[k][body] = held_[k][body] + change_[body];
    }
    return size;
  }
  /// Packs change_ and replaces it by what a receiver unpacks.
  Result<std::size_t> pack_changes(double tolerance) {
    const std::unique_ptr<zfp_field, void (*)(zfp_field*)> field(
        zfp_field_1d(change_.data(), zfp_type_double, setting_.bodies), &zfp_field_free);
    const std::unique_ptr<zfp_stream, void (*)(zfp_stream*)> zfp(zfp_stream_open(nullptr), &zfp_stream_close);
    zfp_stream_set_accuracy(zfp.get(), tolerance);
    buffer_.resize(zfp_stream_maximum_size(zfp.get(), field.get()));
    const std::unique_ptr<bitstream, void (*)(bitstream*)> bits(stream_open(buffer_.data(), buffer_.size()),
                                                                &stream_close);
    zfp_stream_set_bit_stream(zfp.get(), bits.get());
    zfp_stream_rewind(zfp.get());
    const std::size_t size = zfp_compress(zfp.get(), field.get());
    zfp_stream_rewind(zfp.get());
    if (size == 0 || zfp_decompress(zfp.get(), field.get()) == 0)
      return fail(ErrorCode::kUnsupported, "zfp: cannot pack a frame");
    return size;
  }

  PeerSetting setting_;
  Columns held_, next_;
  std::vector<double> change_;
  std::vector<std::uint8_t> buffer_;
};
std::unique_ptr<Peer> make_zfp(const PeerSetting& setting) { return std::make_unique<Zfp>(setting); }
#else
constexpr std::unique_ptr<Peer> (*make_zfp)(const PeerSetting&) = nullptr;
#endif

#ifdef TANDEM_HAVE_DRACO
/// One point cloud per frame, in the order of the bodies so that they keep their identity, on the coarsest
/// lattice that keeps to the threshold; Draco has no memory of earlier frames.
class Draco : public Peer {
 public:
  explicit Draco(const PeerSetting& setting) : setting_(setting) {}

  Result<std::size_t> send(const engine::Bodies& bodies, Columns& seen) override {
    draco::PointCloud cloud;
    cloud.set_num_points(setting_.bodies);
    draco::GeometryAttribute geometry;
    geometry.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 12, 0);
    const int id = cloud.AddAttribute(geometry, true, setting_.bodies);
    std::array<float, 3> low{}, high{};
    low.fill(std::numeric_limits<float>::max());
    high.fill(std::numeric_limits<float>::lowest());
    for (std::uint32_t body = 0; body < setting_.bodies; ++body) {
      std::array<float, 3> point{};
      for (std::size_t k = 0; k < 3; ++k) {
        if (bodies.alive[body] != 0) point[k] = bodies.position[k][body];
        low[k] = std::min(low[k], point[k]);
        high[k] = std::max(high[k], point[k]);
      }
      cloud.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(body), point.data());
    }
    const double range = std::max(
        {double{high[0] - low[0]}, double{high[1] - low[1]}, double{high[2] - low[2]}, setting_.threshold});
    return pack(cloud, id, low, range, seen);
  }

 private:
  Result<std::size_t> pack(const draco::PointCloud& cloud, int id, const std::array<float, 3>& low,
                           double range, Columns& seen) {
    // Draco divides a range into 2^bits - 1 steps: a larger range makes the step exactly the allowed maximum.
    const double step = 2 * setting_.threshold / std::sqrt(3.0);
    const int bits = std::max(1, static_cast<int>(std::ceil(std::log2(range / step + 1))));
    const double widened = step * (std::exp2(bits) - 1);
    draco::ExpertEncoder encoder(cloud);
    encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
    encoder.SetSpeedOptions(0, 0);
    encoder.SetAttributeExplicitQuantization(id, bits, 3, low.data(), static_cast<float>(widened));
    draco::EncoderBuffer packed;
    if (const draco::Status status = encoder.EncodeToBuffer(&packed); !status.ok())
      return fail(ErrorCode::kUnsupported, status.error_msg_string());
    draco::DecoderBuffer input;
    input.Init(packed.data(), packed.size());
    draco::Decoder decoder;
    const auto decoded = decoder.DecodePointCloudFromBuffer(&input);
    if (!decoded.ok()) return fail(ErrorCode::kUnsupported, decoded.status().error_msg_string());
    const draco::PointAttribute* const attribute =
        decoded.value()->GetNamedAttribute(draco::GeometryAttribute::POSITION);
    if (attribute == nullptr || decoded.value()->num_points() != setting_.bodies)
      return fail(ErrorCode::kUnsupported, "draco: other points come out than went in");
    std::array<float, 3> point{};
    for (std::uint32_t body = 0; body < setting_.bodies; ++body) {
      attribute->GetMappedValue(draco::PointIndex(body), point.data());
      for (std::size_t k = 0; k < 3; ++k) seen[k][body] = double{point[k]};
    }
    return packed.size();
  }

  PeerSetting setting_;
};
std::unique_ptr<Peer> make_draco(const PeerSetting& setting) { return std::make_unique<Draco>(setting); }
#else
constexpr std::unique_ptr<Peer> (*make_draco)(const PeerSetting&) = nullptr;
#endif

}  // namespace

const std::vector<PeerKind>& peer_kinds() {
  static const std::vector<PeerKind> kinds{{"draco", "libdraco-dev", make_draco},
                                           {"zfp", "libzfp-dev", make_zfp},
                                           {"zstd", "libzstd-dev", make_zstd},
                                           {"dis-1", "", &make_first_order},
                                           {"dis-2", "", &make_second_order}};
  return kinds;
}

}  // namespace tandem::lab
