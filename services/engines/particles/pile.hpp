#pragma once
// The bodies in the order in which the hot loops visit them, their neighbours, and which of them sleep.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "sdk/workers/workers.hpp"
#include "services/engines/common/world.hpp"
#include "services/engines/particles/columns.hpp"
#include "services/engines/particles/grid.hpp"
#include "services/engines/particles/kernels.hpp"
#include "services/engines/particles/record.hpp"
#include "services/engines/particles/strays.hpp"
#include "services/engines/particles/surfaces.hpp"

namespace tandem::engine {

/// Each living body has a place. Places are given by cell when the bodies are sorted, and stay until they are
/// sorted again, so that neighbours are near in memory. A body's forces are summed in the order scene, then
/// partners by ascending place: that order, and nothing else of what is kept here, decides the bits. It is a
/// part of the checkpoint.
///
/// A body's list holds all that are near to it: nearer, between their anchors, than both radii and the skin.
/// A body's anchor is where it was when its list was made. A body that is further from its anchor than half
/// the skin gets a new one, and its neighbours' lists get it (adopt_moved()); only when many have moved are
/// all sorted and listed anew. As only distances between bodies count, the anchors drift with the mean
/// velocity: a pile that falls or slides as a whole keeps its lists. They stand while anybody sleeps. If the
/// bodies are so fast that lists would not last a second step, there is no skin: they are sorted in each
/// step, and a list lives as long as its group is computed.
///
/// Places are cut into blocks. A block whose bodies were all slow and touched something for a while sleeps:
/// its bodies stand still, and cost nothing, until a fast body touches one of them, a body that one leans on
/// moves away, a push reaches one, or gravity changes.
///
/// Between the calls of one step nothing depends on the number of threads. Not thread-safe.
class Pile {
 public:
  Pile(const EngineWorld& world, Workers& workers, std::uint32_t threads, Instructions instructions);

  /// Takes the living bodies of `columns`, in the order of their slots.
  void start(const Columns& columns);

  [[nodiscard]] Vec3f position(std::uint32_t slot) const;
  /// Changes a body's velocity; wakes it.
  void push(std::uint32_t slot, const Vec3f& change);
  /// If `gravity` is not that of the step before, all wake.
  void feel(const Vec3& gravity);
  /// Equation 3.1 with the forces found last: v = (v + kick + h * force / mass) * keep, p += h * v.
  void integrate(float h, float keep, const Vec3f& kick);
  /// Slots whose bodies the last integrate() took out of the world, in no particular order. They must be
  /// removed before the next find_contacts().
  [[nodiscard]] std::span<const std::uint32_t> leavers() const { return leavers_; }

  // What happens to bodies between integrate() and find_contacts(). Points must lie within the world.
  void remove(std::uint32_t slot);
  void add(std::uint32_t slot, const Vec3f& at, const Vec3f& velocity, std::uint16_t type);
  void move(std::uint32_t slot, const Vec3f& to);
  void set_type(std::uint32_t slot, std::uint16_t type);

  /// Sums the forces that act in the next step. `last`: of the step, so that bodies may fall asleep.
  void find_contacts(bool last);
  /// Writes positions and velocities of the bodies that moved since the last call, and marks their slots in
  /// columns.moved.
  void publish(Columns& columns);
  /// Bodies that touch something.
  [[nodiscard]] std::uint32_t touching() const;
  [[nodiscard]] std::uint32_t asleep() const;  ///< bodies

  void save(PileImage& out) const;
  /// Restores what save() wrote of the bodies of `columns`. Returns false and leaves *this in an unknown
  /// state if they do not fit together.
  [[nodiscard]] bool load(const Columns& columns, const PileImage& image);

 private:
  static constexpr std::uint32_t kBlock = 64;  ///< places; a multiple of kGroup
  static constexpr std::uint32_t kGroupsInBlock = kBlock / kGroup;
  /// One anchor after another, adopting this share of the bodies takes as long as listing all anew.
  static constexpr std::uint32_t kMaxMoved = 16;
  /// If more than this share are far from where they were sorted, they cost too many cache misses.
  static constexpr std::uint32_t kMaxAdopted = 4;
  static constexpr std::uint32_t kRows = 24;          ///< of a list that is kept
  static constexpr std::uint32_t kScratchRows = 128;  ///< of a list that is made anew in each step
  static constexpr std::uint32_t kMaxFound = kMaxNeighbours + 512;  ///< by a search
  static constexpr std::uint8_t kUnlisted = 255;                    ///< rows of a group without a list
  static constexpr std::uint8_t kSpilled = 254;  ///< rows of a group whose lists are too long to be kept

  // What is known of a place besides its record.
  static constexpr std::uint8_t kQuietMask = 0x3F;  ///< steps that the body was quiet, up to kQuietSteps
  static constexpr std::uint8_t kTouching = 0x40;
  static constexpr std::uint8_t kAdopted = 0x80;
  static constexpr std::uint8_t kQuietSteps = 30;

  /// Who may be near to the bodies of a cell.
  struct Look {
    Neighbourhood sorted;
    Strays::Runs strays;
  };

  struct Scratch {
    Rows rows;
    std::array<Look, 2> looks;
    // Two, as a processor waits if it reads at once what it wrote in other pieces.
    std::array<Vicinity, 2> vicinities;
    // By body: its list, and behind it places that are nowhere.
    std::array<std::array<std::uint32_t, kScratchRows + 2 * kGroup>, kGroup> lanes;
    std::array<std::uint32_t, kMaxFound + 2 * kGroup> found;
    alignas(64) std::array<std::uint32_t, kScratchRows * kGroup> entries;
  };

  [[nodiscard]] std::uint32_t blocks() const { return (count_ + kBlock - 1) / kBlock; }
  [[nodiscard]] std::uint32_t anchor_cell(std::uint32_t place) const {
    return grid_.cell_of(anchor_[0][place], anchor_[1][place], anchor_[2][place]);
  }
  void clear_place(std::uint32_t place);
  void set_force(std::uint32_t place, const Float3& force);
  void fill(std::uint32_t place, std::uint32_t slot, const Vec3f& at, const Vec3f& velocity,
            std::uint16_t type);
  void set_anchor(std::uint32_t place);

  // pile_order.cpp: places, anchors, lists
  void sort();
  void move_to_places();
  void settle_blocks();
  void gather_loose();
  void adopt_moved();
  bool introduce(std::uint32_t place, const Vec3f& from, const Look& look, Scratch& scratch);
  [[nodiscard]] Strays::Stray stray(std::uint32_t place) const;
  void insert(std::uint32_t place, std::uint32_t partner);
  void set_list(std::uint32_t place, std::span<const std::uint32_t> partners);
  [[nodiscard]] Anchors anchors() const {
    return {anchor_[0].data(), anchor_[1].data(), anchor_[2].data(), anchor_radius_.data()};
  }
  void look_around(std::uint32_t cell, Rows& rows, Look& out) const;
  /// Asks for the memory that introduce() will read.
  void fetch(std::uint32_t place, const Look& look) const;
  /// Adds the adopted that are near to `count` places; some hundred at most. Returns how many there are then,
  /// all ascending, and not more than `most`.
  std::uint32_t add_strays(const Seeker& seeker, const Look& look, std::uint32_t most, std::uint32_t* places,
                           std::uint32_t count) const;
  [[nodiscard]] Seeker seeker(std::uint32_t place) const {
    return {anchor_[0][place], anchor_[1][place], anchor_[2][place], records_[place].radius + skin_, place};
  }
  /// Places near to a point, ascending.
  [[nodiscard]] std::span<const std::uint32_t> find_near(const Seeker& seeker, const Look& look,
                                                         Scratch& scratch) const;
  std::uint32_t make_lists(std::uint32_t group, Scratch& scratch) const;
  static void weave(const Scratch& scratch, std::uint32_t rows, std::uint32_t* entries);

  // pile_contacts.cpp: forces, sleep
  void list_awake();
  void sum_blocks(std::span<const std::uint32_t> blocks, bool regular, bool last);
  void sum_block(std::uint32_t block, Scratch& scratch, bool regular, bool last);
  bool note_states(std::uint32_t first, std::uint32_t living, std::uint32_t touching,
                   const std::uint32_t* calm);
  std::uint32_t lists_of(std::uint32_t group, Scratch& scratch, const std::uint32_t*& entries);
  void wake_touched(std::uint32_t first, std::uint32_t lanes, const std::uint32_t* entries,
                    std::uint32_t rows);
  void wake_near(const Vec3f& at, float radius);
  void mark(std::uint32_t block);
  bool wake_marked();
  void fall_asleep();

  const EngineWorld* world_;
  Workers* workers_;
  std::uint32_t threads_;
  const Kernels* kernels_;
  Surfaces surfaces_;
  float usual_skin_, sleep_speed_;
  Grid grid_;

  // By place.
  std::uint32_t count_ = 0;    ///< places in use, some without a body
  std::uint32_t most_places_;  ///< a multiple of kBlock; the place after it is nowhere
  std::vector<Record> records_, spare_records_;
  std::vector<float> inverse_mass_, spare_inverse_mass_;
  std::vector<std::uint8_t> state_, spare_state_;
  std::array<std::vector<float>, 3> anchor_;
  static constexpr float kNotFound = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> anchor_radius_;
  std::vector<std::uint32_t> cell_;  ///< while sorting
  std::vector<std::uint32_t> to_;    ///< while sorting; then, of an adopted body, its number among strays_

  std::vector<std::uint32_t> place_of_;  ///< by slot

  // By group.
  std::vector<Forces> forces_;
  std::unique_ptr<std::uint32_t[]> entries_;  ///< kRows rows of kGroup places each
  std::vector<std::uint8_t> rows_, locks_;

  // By block.
  std::vector<std::uint8_t> asleep_, marked_, quiet_, changed_, touching_;
  std::vector<std::uint64_t> outside_, loose_;
  std::vector<Vec3f> velocity_sum_;
  std::vector<std::uint32_t> awake_;  ///< block numbers

  std::unique_ptr<Scratch> scratch_ = std::make_unique<Scratch>();  ///< of the caller's thread
  Strays strays_;                                                   ///< the adopted
  std::vector<std::uint32_t> leavers_, moved_, woken_;
  std::vector<std::uint32_t> strange_;  ///< of moved_: those that may have partners who do not list them
  std::vector<Vec3f> left_;             ///< the anchors that moved_ had
  std::uint32_t sleeping_blocks_ = 0;
  float skin_ = 0;
  Vec3f drift_{};          ///< of all anchors since the bodies were sorted
  Vec3f mean_velocity_{};  ///< of the bodies in the last integrate(); 0 while anybody sleeps
  bool sorted_ = false;    ///< the order is that of a sort
  bool crowded_ = false;   ///< a cell was full
  bool any_marked_ = false, all_changed_ = true;  ///< of marked_, changed_
  Vec3 felt_gravity_{};
};

}  // namespace tandem::engine
