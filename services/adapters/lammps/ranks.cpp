// SPDX-License-Identifier: MIT
#include "services/adapters/lammps/ranks.hpp"

#include <chrono>
#include <thread>

namespace tandem_lammps {

Ranks::Ranks(MPI_Comm comm) : comm_(comm) {
  MPI_Comm_rank(comm_, &rank_);
  MPI_Comm_size(comm_, &count_);
}

void Ranks::share(std::vector<std::uint8_t>& bytes) const {
  std::uint64_t size = bytes.size();
  MPI_Bcast(&size, 1, MPI_UINT64_T, 0, comm_);
  bytes.resize(size);
  MPI_Bcast(bytes.data(), static_cast<int>(size), MPI_BYTE, 0, comm_);
}

void Ranks::share(std::string& text) const {
  std::vector<std::uint8_t> bytes(text.begin(), text.end());
  share(bytes);
  text.assign(bytes.begin(), bytes.end());
}

void Ranks::share_patiently(void* bytes, int size) const {
  // Sleeping begins after the longest time that a server with little to do takes between two questions of a
  // frame.
  constexpr std::chrono::microseconds kAwake{200}, kNap{50};
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibcast(bytes, size, MPI_BYTE, 0, comm_, &request);
  const auto began = std::chrono::steady_clock::now();
  for (int done = 0;;) {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done != 0) return;
    if (std::chrono::steady_clock::now() - began > kAwake) std::this_thread::sleep_for(kNap);
  }
}

double Ranks::reduce(double value, MPI_Op op) const {
  double result = 0;
  MPI_Allreduce(&value, &result, 1, MPI_DOUBLE, op, comm_);
  return result;
}

}  // namespace tandem_lammps
