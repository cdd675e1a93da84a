#include "sdk/transport/dds/history_cache.hpp"

#include <dds/ddsi/ddsi_tkmap.h>

#include <cstdint>

namespace tandem::transport::dds {

// No sample is kept: reading finds nothing, and there is nothing to update.
constinit const dds_rhc_ops HistoryCache::operations = [] {
  dds_rhc_ops ops{};
  ops.rhc_ops.store = &HistoryCache::store;
  ops.rhc_ops.unregister_wr = [](ddsi_rhc*, const ddsi_writer_info*) {};
  ops.rhc_ops.relinquish_ownership = [](ddsi_rhc*, std::uint64_t) {};
  ops.rhc_ops.set_qos = [](ddsi_rhc*, const dds_qos*) {};
  ops.rhc_ops.free = &HistoryCache::free;
  ops.read = ops.take = [](dds_rhc*, bool, void**, dds_sample_info_t*, std::uint32_t, std::uint32_t,
                           dds_instance_handle_t, dds_readcond*) { return 0; };
  ops.readcdr =
      ops.takecdr = [](dds_rhc*, bool, ddsi_serdata**, dds_sample_info_t*, std::uint32_t, std::uint32_t,
                       std::uint32_t, std::uint32_t, dds_instance_handle_t) { return 0; };
  ops.add_readcondition = [](dds_rhc*, dds_readcond*) { return false; };
  ops.remove_readcondition = [](dds_rhc*, dds_readcond*) {};
  ops.lock_samples = [](dds_rhc*) { return 0U; };
  ops.associate = &HistoryCache::associate;
  return ops;
}();

HistoryCache::HistoryCache(OnSample call, void* argument) : dds_rhc{}, call_(call), argument_(argument) {
  common.ops = &operations;
}

bool HistoryCache::store(ddsi_rhc* self, const ddsi_writer_info* writer, ddsi_serdata* sample,
                         ddsi_tkmap_instance* instance) {
  // The cache begins with the part that the protocol layer sees.
  auto& cache = *static_cast<HistoryCache*>(reinterpret_cast<dds_rhc*>(self));
  cache.hold(instance);
  // A sample without data only tells that its instance was disposed of or has lost its writer.
  if (sample->kind == SDK_DATA) cache.call_(cache.argument_, writer->iid, *sample);
  return true;
}

dds_return_t HistoryCache::associate(dds_rhc* self, dds_reader* /*reader*/, const ddsi_sertype* /*type*/,
                                     ddsi_tkmap* instances) {
  static_cast<HistoryCache*>(self)->instances_ = instances;
  return DDS_RETCODE_OK;
}

void HistoryCache::free(ddsi_rhc* self) {
  static_cast<HistoryCache*>(reinterpret_cast<dds_rhc*>(self))->hold(nullptr);
}

void HistoryCache::hold(ddsi_tkmap_instance* instance) {
  if (held_.load(std::memory_order_relaxed) == instance) return;
  if (instance != nullptr) ddsi_tkmap_instance_ref(instance);
  ddsi_tkmap_instance* const last = held_.exchange(instance);
  if (last != nullptr) ddsi_tkmap_instance_unref(instances_, last);
}

}  // namespace tandem::transport::dds
