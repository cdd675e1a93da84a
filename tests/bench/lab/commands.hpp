#pragma once
// The subcommands of bench_lab.

#include <atomic>
#include <functional>

#include "services/program/commandline/commandline.hpp"
#include "tandem/result.hpp"

namespace tandem::lab {

/// Each adds one subcommand to `app`; when the command line chooses it, its callback sets `run`.
void add_client_process(commandline::Command app, std::function<int()>& run);
void add_door(commandline::Command app, std::function<int()>& run);
void add_engine(commandline::Command app, std::function<int()>& run);
void add_framerate(commandline::Command app, std::function<int()>& run);
void add_memory(commandline::Command app, std::function<int()>& run);
void add_scale(commandline::Command app, std::function<int()>& run);
void add_smoothing(commandline::Command app, std::function<int()>& run);
void add_train(commandline::Command app, std::function<int()>& run);

/// Prints the error to stderr. Returns the exit code: 2 if the user named something that does not exist or is
/// out of range, else 1.
int refuse(const char* command, const Error& error);

/// Becomes true once a signal asks to stop. It ends no process from the first call on.
[[nodiscard]] const std::atomic<bool>& stop_on_signals();

}  // namespace tandem::lab
