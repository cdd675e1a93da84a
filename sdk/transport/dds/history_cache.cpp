#include "sdk/transport/dds/history_cache.hpp"

#include <cstdint>

namespace tandem::transport::dds {

// Nothing is kept: reading finds nothing, and there is nothing to update or to free.
constinit const dds_rhc_ops HistoryCache::kOps = [] {
  dds_rhc_ops ops{};
  ops.rhc_ops.store = &HistoryCache::store;
  ops.rhc_ops.unregister_wr = [](ddsi_rhc*, const ddsi_writer_info*) {};
  ops.rhc_ops.relinquish_ownership = [](ddsi_rhc*, std::uint64_t) {};
  ops.rhc_ops.set_qos = [](ddsi_rhc*, const dds_qos*) {};
  ops.rhc_ops.free = [](ddsi_rhc*) {};
  ops.read = ops.take = [](dds_rhc*, bool, void**, dds_sample_info_t*, std::uint32_t, std::uint32_t,
                           dds_instance_handle_t, dds_readcond*) { return 0; };
  ops.readcdr =
      ops.takecdr = [](dds_rhc*, bool, ddsi_serdata**, dds_sample_info_t*, std::uint32_t, std::uint32_t,
                       std::uint32_t, std::uint32_t, dds_instance_handle_t) { return 0; };
  ops.add_readcondition = [](dds_rhc*, dds_readcond*) { return false; };
  ops.remove_readcondition = [](dds_rhc*, dds_readcond*) {};
  ops.lock_samples = [](dds_rhc*) { return 0U; };
  ops.associate = [](dds_rhc*, dds_reader*, const ddsi_sertype*, ddsi_tkmap*) { return DDS_RETCODE_OK; };
  return ops;
}();

HistoryCache::HistoryCache(OnSample call, void* argument) : dds_rhc{}, call_(call), argument_(argument) {
  common.ops = &kOps;
}

bool HistoryCache::store(ddsi_rhc* self, const ddsi_writer_info* writer, ddsi_serdata* sample,
                         ddsi_tkmap_instance* /*instance*/) {
  // The cache begins with what the protocol layer sees of it.
  const auto& cache = *static_cast<HistoryCache*>(reinterpret_cast<dds_rhc*>(self));
  // A sample without data only tells that its instance was disposed of or lost its writer.
  if (sample->kind == SDK_DATA) cache.call_(cache.argument_, writer->iid, *sample);
  return true;
}

}  // namespace tandem::transport::dds
