#pragma once
// How the thread that drives a host sleeps.

#include <chrono>

#include "sdk/wire/port.hpp"
#include "services/host/host.hpp"

namespace tandem::host {

/// Sleeps until something arrived, the frame under way can be finished, or `longest` is over. While a frame
/// is under way with a descriptor, what arrives waits for up to 2 ms.
void wait_for_work(const Host& host, transport::ServerPort& port, std::chrono::nanoseconds longest);

}  // namespace tandem::host
