#pragma once
// Sends something large in parts to one receiver, at the pace of that receiver's link.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "services/host/accounts/transfer_window.hpp"

namespace tandem::accounts {

/// Decides which part is sent when: in order, within a TransferWindow, and again what DDS has lost. Knows
/// nothing of what the parts hold. Not thread-safe.
class Passage {
 public:
  /// `bytes` in parts of `part_bytes`, of which the last may be smaller; neither is 0.
  Passage(std::size_t bytes, std::size_t part_bytes, std::int64_t now_ns);

  /// Notes what the receiver holds: all parts but those of `missing`, runs of a first part and a count.
  /// Untrusted: parts that were never sent and runs that make no sense change nothing.
  void acknowledged(std::span<const std::uint32_t> missing, std::int64_t now_ns);
  /// The part to send now, if one may be sent; it counts as sent.
  [[nodiscard]] std::optional<std::size_t> next(std::int64_t now_ns);
  /// When next() may have a part that it does not have now, if no acknowledgement comes.
  [[nodiscard]] std::int64_t next_ns() const;

  /// See TransferWindow::limit().
  void limit(double bytes_per_s) { window_.limit(bytes_per_s); }

  [[nodiscard]] std::size_t parts() const { return holds_.size(); }
  [[nodiscard]] std::size_t size_of(std::size_t part) const;
  /// True once the receiver holds every part.
  [[nodiscard]] bool complete() const { return held_ == holds_.size(); }
  [[nodiscard]] std::int64_t began_ns() const { return began_ns_; }
  /// When the receiver last named what it is sent.
  [[nodiscard]] std::int64_t heard_ns() const { return heard_ns_; }
  [[nodiscard]] std::int64_t progress_ns() const { return progress_ns_; }  ///< when a part last arrived
  /// True if several times the size was sent. The receiver's acknowledgements cannot be right then, and it is
  /// served no further.
  [[nodiscard]] bool exhausted() const;

 private:
  struct Flying {
    std::size_t part = 0;
    TransferWindow::Sent sent;
  };

  [[nodiscard]] std::optional<std::size_t> wanted();
  void hold(std::size_t part);
  /// Parts that the receiver held, and lacks by now, are sent again.
  void take_back(std::span<const std::uint32_t> missing);
  void arrived(const std::vector<bool>& held, std::int64_t now_ns);
  std::size_t send(std::size_t part, std::int64_t now_ns);
  [[nodiscard]] std::int64_t probe_ns() const;

  std::size_t bytes_, part_bytes_;
  std::vector<bool> holds_;        // by part: the receiver holds it
  std::size_t held_ = 0;           // parts
  std::size_t unsent_ = 0;         // the first part that was never sent
  std::deque<std::size_t> again_;  // parts that DDS lost, to be sent again
  std::deque<Flying> flying_;      // in the order of sending
  TransferWindow window_;
  std::int64_t began_ns_, heard_ns_, progress_ns_;
  std::int64_t probed_ns_;
  int probes_ = 0;  // probes since a part last arrived
  std::size_t sent_bytes_ = 0;
};

}  // namespace tandem::accounts
