#pragma once
// fork() copies only the calling thread. In the child the clients' threads do not exist and their locks have
// no owner.

namespace tandem::api {

/// Makes in_forked_child() work from now on. Call it before there is a handle.
void watch_forks();
/// True if this process was made by fork() after watch_forks(). It holds nothing of its parent.
[[nodiscard]] bool in_forked_child();

}  // namespace tandem::api
