#pragma once
// What is expected of the first process of a container.

namespace tandem {

/// Process 1 of a PID namespace gets the orphans of all others, such as what an engine left behind, and has
/// to ask how they ended, or they stay as zombies. There, this starts a child, which returns; process 1
/// itself does nothing but pass signals on to it and take what ends, until it ends itself with the child's
/// exit code (128 and the signal's number if a signal ended it). Everywhere else it does nothing. Call it
/// before any thread is started.
void leave_process_1();

}  // namespace tandem
