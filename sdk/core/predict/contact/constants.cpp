#include "sdk/core/predict/contact/constants.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

// Reads one value after another and remembers whether all lay within their limits.
class Values {
 public:
  explicit Values(std::span<const std::int32_t> values) : values_(values) {}

  std::int32_t take(std::int32_t least, std::int32_t most) {
    if (next_ == values_.size()) {
      good_ = false;
      return least;
    }
    const std::int32_t value = values_[next_++];
    if (value >= least && value <= most) return value;
    good_ = false;
    return least;
  }
  std::size_t take_count(std::size_t least, std::size_t most) {
    return static_cast<std::size_t>(take(static_cast<std::int32_t>(least), static_cast<std::int32_t>(most)));
  }
  Vec3i take_vector(std::int32_t least, std::int32_t most) {
    Vec3i vector{};
    for (std::int32_t& x : vector) x = take(least, most);
    return vector;
  }
  ContactMaterial take_material() {
    ContactMaterial material;
    material.spring = take(0, ContactMaterial::kMaxSpring);
    material.damping = take(0, ContactMaterial::kMaxDamping);
    material.shear = take(0, ContactMaterial::kMaxDamping);
    return material;
  }
  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] std::size_t left() const { return values_.size() - next_; }

 private:
  std::span<const std::int32_t> values_;
  std::size_t next_ = 0;
  bool good_ = true;
};

constexpr std::size_t kTypeValues = 2;
constexpr std::size_t kPlaneValues = 4;
constexpr std::size_t kBoxValues = 15;
constexpr std::size_t kBallValues = 4;
constexpr std::size_t kMaxTypes = 65536;
constexpr std::int32_t kMaxSpringOfOneStep = 10240;  // 5/8; a stiffer spring oscillates

}  // namespace

ContactConstants in_one_step(ContactConstants constants) {
  const std::int32_t substeps = constants.substeps;
  TANDEM_ASSERT(1 <= substeps && substeps <= ContactConstants::kMaxSubsteps);
  if (substeps == 1) return constants;
  for (ContactMaterial* const material : {&constants.pair, &constants.wall}) {
    const std::int32_t drag = substeps * (material->damping + material->shear) * 5 / 8;
    material->spring = std::min(substeps * material->spring, kMaxSpringOfOneStep);
    material->shear = std::min({substeps * material->shear, drag, ContactMaterial::kMaxDamping});
    material->damping = std::min(drag - material->shear, ContactMaterial::kMaxDamping);
  }
  constants.substeps = 1;
  return constants;
}

std::vector<std::int32_t> write_contact_constants(const ContactConstants& constants) {
  std::vector<std::int32_t> out{constants.substeps};
  const auto put = [&out](const Vec3i& vector) { out.insert(out.end(), vector.begin(), vector.end()); };
  for (const ContactMaterial& m : {constants.pair, constants.wall}) put({m.spring, m.damping, m.shear});
  for (const std::size_t count :
       {constants.types.size(), constants.planes.size(), constants.boxes.size(), constants.balls.size()}) {
    out.push_back(static_cast<std::int32_t>(count));
  }
  for (const auto& type : constants.types) {
    out.push_back(type.radius);
    out.push_back(type.mobility);
  }
  for (const auto& plane : constants.planes) {
    put(plane.normal);
    out.push_back(plane.offset);
  }
  for (const auto& box : constants.boxes) {
    put(box.centre);
    put(box.half);
    for (const Vec3i& axis : box.axes) put(axis);
  }
  for (const auto& ball : constants.balls) {
    put(ball.centre);
    out.push_back(ball.radius);
  }
  return out;
}

ContactCounts count_contact_constants(std::span<const std::int32_t> values) {
  constexpr std::size_t kShapesAt = 8;  // behind the sub-steps, two materials and the number of types
  if (values.size() < kShapesAt + 3) return {};
  const auto count = [values](std::size_t at) {
    return static_cast<std::uint32_t>(std::clamp<std::int32_t>(values[at], 0, ContactConstants::kMaxShapes));
  };
  return {count(0), count(kShapesAt), count(kShapesAt + 1), count(kShapesAt + 2)};
}

Result<ContactConstants> read_contact_constants(std::span<const std::int32_t> values) {
  using C = ContactConstants;
  Values in(values);
  C constants;
  constants.substeps = in.take(1, C::kMaxSubsteps);
  constants.pair = in.take_material();
  constants.wall = in.take_material();
  const std::size_t types = in.take_count(1, kMaxTypes);
  const std::size_t planes = in.take_count(0, C::kMaxShapes);
  const std::size_t boxes = in.take_count(0, C::kMaxShapes);
  const std::size_t balls = in.take_count(0, C::kMaxShapes);
  // Checked before memory is reserved.
  if (!in.good() ||
      in.left() != types * kTypeValues + planes * kPlaneValues + boxes * kBoxValues + balls * kBallValues) {
    return fail(ErrorCode::kMalformed, "predictor: constants of wrong number or range");
  }
  constants.types.resize(types);
  for (auto& type : constants.types) {
    type.radius = in.take(1, C::kMaxRadius);
    type.mobility = in.take(0, C::kMaxMobility);
  }
  constants.planes.resize(planes);
  for (auto& plane : constants.planes) {
    plane.normal = in.take_vector(-C::kOne, C::kOne);
    plane.offset = in.take(-kPositionLimit, kPositionLimit);
  }
  constants.boxes.resize(boxes);
  for (auto& box : constants.boxes) {
    box.centre = in.take_vector(-kPositionLimit, kPositionLimit);
    box.half = in.take_vector(0, kPositionLimit);
    for (Vec3i& axis : box.axes) axis = in.take_vector(-C::kOne, C::kOne);
  }
  constants.balls.resize(balls);
  for (auto& ball : constants.balls) {
    ball.centre = in.take_vector(-kPositionLimit, kPositionLimit);
    ball.radius = in.take(0, kPositionLimit);
  }
  if (!in.good()) return fail(ErrorCode::kMalformed, "predictor: constant out of range");
  return constants;
}

}  // namespace tandem
