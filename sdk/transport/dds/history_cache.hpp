#pragma once
// A reader's history cache that keeps nothing.

#include <dds/dds.h>
#include <dds/ddsc/dds_rhc.h>
#include <dds/ddsi/ddsi_serdata.h>

#include <atomic>

namespace tandem::transport::dds {

/// Passes on every sample with data as it arrives. The default cache of Cyclone DDS has two faults. All
/// writers of a key share one history, so that one of them can displace the samples of the others. And it
/// remembers every key while its writer lives, which is half a kilobyte for each number that a stranger makes
/// up.
class HistoryCache : public dds_rhc {
 public:
  /// Called in threads of Cyclone DDS, several at once.
  using OnSample = void (*)(void* argument, dds_instance_handle_t writer, ddsi_serdata& sample);

  HistoryCache(OnSample call, void* argument);
  HistoryCache(const HistoryCache&) = delete;
  HistoryCache& operator=(const HistoryCache&) = delete;
  ~HistoryCache() = default;

 private:
  static bool store(ddsi_rhc* self, const ddsi_writer_info* writer, ddsi_serdata* sample,
                    ddsi_tkmap_instance* instance);
  static dds_return_t associate(dds_rhc* self, dds_reader* reader, const ddsi_sertype* type,
                                ddsi_tkmap* instances);
  static void free(ddsi_rhc* self);
  static const dds_rhc_ops operations;

  void hold(ddsi_tkmap_instance* instance);

  OnSample call_;
  void* argument_;
  ddsi_tkmap* instances_ = nullptr;  // the instances of the domain
  // The instance of the last sample. An instance that is not held is freed after each sample and made again
  // for the next, which wakes Cyclone's collector each time.
  std::atomic<ddsi_tkmap_instance*> held_ = nullptr;
};

}  // namespace tandem::transport::dds
