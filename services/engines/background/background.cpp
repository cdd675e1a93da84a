#include "services/engines/background/background.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <semaphore>
#include <thread>
#include <utility>

namespace tandem::engine {
namespace {

class Background final : public Simulation {
 public:
  Background(std::unique_ptr<Simulation> simulation, int made)
      : simulation_(std::move(simulation)), made_(made), thread_([this] { work(); }) {}
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  Background(Background&&) = delete;
  Background& operator=(Background&&) = delete;
  ~Background() override {
    wait();
    ends_ = true;
    wanted_.release();
    thread_.join();
    ::close(made_);
  }

  void step() override {
    wait();
    simulation_->step();
  }
  void begin_step() override {
    wait();
    stepping_.store(true, std::memory_order_relaxed);
    wanted_.release();
  }
  bool step_ready() override {
    if (stepping_.load(std::memory_order_acquire)) return false;
    wait();  // makes the descriptor unreadable until the next step is made
    return true;
  }
  [[nodiscard]] int step_descriptor() const override { return made_; }
  std::string failure() override {
    // Asked often, and a step that is under way has not failed yet.
    return stepping_.load(std::memory_order_acquire) ? std::string() : rested().failure();
  }

  [[nodiscard]] std::uint32_t capacity() const override { return rested().capacity(); }
  [[nodiscard]] double dt_s() const override { return rested().dt_s(); }
  [[nodiscard]] Vec3 gravity() const override { return rested().gravity(); }
  [[nodiscard]] double damping_per_s() const override { return rested().damping_per_s(); }
  [[nodiscard]] Classification classify(const Input& input) const override {
    return rested().classify(input);
  }
  [[nodiscard]] InputBudget input_budget() const override { return rested().input_budget(); }
  void apply(const Input& input) override { rested().apply(input); }
  [[nodiscard]] Bodies bodies() const override { return rested().bodies(); }
  [[nodiscard]] std::span<const Event> events() const override { return rested().events(); }
  [[nodiscard]] std::span<const std::uint8_t> moved() const override { return rested().moved(); }
  [[nodiscard]] NewsFeatures tells() const override { return rested().tells(); }
  void tell(StepNews& news) override { rested().tell(news); }
  [[nodiscard]] std::uint32_t colliding() const override { return rested().colliding(); }
  [[nodiscard]] Mishaps mishaps() const override { return rested().mishaps(); }
  [[nodiscard]] std::vector<BodyName> names() const override { return rested().names(); }
  [[nodiscard]] std::uint64_t names_version() const override { return rested().names_version(); }
  void save(std::vector<std::byte>& out) const override { rested().save(out); }
  bool load(std::span<const std::byte> bytes) override { return rested().load(bytes); }

 private:
  void work() {
    while (true) {
      wanted_.acquire();
      if (ends_) return;
      simulation_->step();
      ::eventfd_write(made_, 1);  // first, so that wait() finds it
      stepping_.store(false, std::memory_order_release);
      stepping_.notify_one();
    }
  }
  void wait() const {
    stepping_.wait(true, std::memory_order_acquire);
    eventfd_t steps = 0;
    ::eventfd_read(made_, &steps);
  }
  Simulation& rested() const {
    wait();
    return *simulation_;
  }

  std::unique_ptr<Simulation> simulation_;
  int made_;  // descriptor
  std::atomic<bool> stepping_{false};
  std::binary_semaphore wanted_{0};
  std::atomic<bool> ends_{false};
  std::thread thread_;  // last member: it uses the others
};

}  // namespace

Result<std::unique_ptr<Simulation>> step_in_background(std::unique_ptr<Simulation> simulation) {
  const int made = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (made < 0)
    return fail(ErrorCode::kIo, "no event descriptor for the simulation's thread: too many open files?");
  return std::unique_ptr<Simulation>(std::make_unique<Background>(std::move(simulation), made));
}

}  // namespace tandem::engine
