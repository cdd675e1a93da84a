// Preloaded into a program: once the file that TANDEM_DEAF names exists, the thread of Cyclone's handshakes
// spins for ever with their lock, which an error of Cyclone DDS 0.10 can bring about
// (sdk/transport/dds/handshake_deadline.cpp).

#include <dlfcn.h>
#include <pthread.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

extern "C" __attribute__((visibility("default"))) void* ddsrt_fibheap_extract_min(const void* definition,
                                                                                  void* heap) {
  char name[16] = {};
  pthread_getname_np(pthread_self(), name, sizeof name);
  if (std::strcmp(name, "fsm") == 0) {
    const char* const file = std::getenv("TANDEM_DEAF");
    volatile bool spins = file != nullptr && access(file, F_OK) == 0;
    while (spins) {
    }
  }
  using Extract = void* (*)(const void*, void*);
  static const auto next = reinterpret_cast<Extract>(dlsym(RTLD_NEXT, "ddsrt_fibheap_extract_min"));
  return next(definition, heap);
}
