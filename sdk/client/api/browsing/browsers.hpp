#pragma once
// The browsers of this process.

#include <memory>

#include "sdk/client/api/browsing/browser.hpp"
#include "sdk/client/api/registry.hpp"
#include "tandem/tandem.h"

namespace tandem::api {

/// tandem_browser_open() for any monitor.
tandem_result browse_over(std::unique_ptr<transport::Monitor> monitor, tandem_browser* browser) noexcept;

}  // namespace tandem::api
