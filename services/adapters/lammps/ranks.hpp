// SPDX-License-Identifier: MIT
#pragma once
// The processes of this program.

#include <mpi.h>

#include <cstdint>
#include <string>
#include <vector>

namespace tandem_lammps {

/// The ranks of a communicator. All of them call each function, in the same order.
class Ranks {
 public:
  explicit Ranks(MPI_Comm comm);
  [[nodiscard]] bool first() const { return rank_ == 0; }
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] MPI_Comm comm() const { return comm_; }

  /// Gives all ranks what the first one has.
  void share(std::vector<std::uint8_t>& bytes) const;
  void share(std::string& text) const;
  /// The same for a wait of any length: ranks without news sleep, where MPI_Bcast would keep a core busy.
  void share_patiently(void* bytes, int size) const;

  [[nodiscard]] double least(double value) const { return reduce(value, MPI_MIN); }
  [[nodiscard]] double most(double value) const { return reduce(value, MPI_MAX); }
  [[nodiscard]] double sum(double value) const { return reduce(value, MPI_SUM); }

 private:
  [[nodiscard]] double reduce(double value, MPI_Op op) const;

  MPI_Comm comm_;
  int rank_ = 0, count_ = 1;
};

}  // namespace tandem_lammps
