#pragma once
// fork() copies the calling thread alone: in the child the clients' threads and locks are those of nobody.

namespace tandem::api {

/// From now on in_forked_child() tells. Called before there is a handle.
void watch_forks();
/// This process came out of fork() after watch_forks(), and holds nothing of its parent's.
[[nodiscard]] bool in_forked_child();

}  // namespace tandem::api
