#include "sdk/transport/dds/node.hpp"

#include <algorithm>
#include <system_error>
#include <thread>

#include "sdk/transport/dds/handshake_deadline.hpp"

namespace tandem::transport::dds {
namespace {

// Cyclone DDS never blocks a keep-last writer because of its history. If a network blocks one, a write checks
// its stop flag at this interval.
constexpr dds_duration_t kMaxBlocking = DDS_MSECS(100);

// Signs of life of a server's DDS participant go to everybody, with an answer each. Those who must know soon
// of its death read a topic that shows life, so that these may be rare.
constexpr int kServersAutomaticLeases = 8;

Qos in_partitions(const std::vector<std::string>& partitions) {
  std::vector<const char*> names;
  names.reserve(partitions.size());
  for (const std::string& partition : partitions) names.push_back(partition.c_str());
  Qos qos(dds_create_qos());
  dds_qset_partition(qos.get(), static_cast<std::uint32_t>(names.size()), names.data());
  return qos;
}

}  // namespace

Qos make_qos(const TopicQos& topic, std::int32_t depth, dds_duration_t lease) {
  Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), topic.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       kMaxBlocking);
  dds_qset_durability(qos.get(),
                      topic.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  // There are no resource limits, because a reliable reader that refuses a sample stops all delivery from
  // that peer until it fits.
  const std::int32_t durable_depth = topic.durable_depth != 0 ? topic.durable_depth : depth;
  dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, durable_depth, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  dds_qset_lifespan(qos.get(), topic.lifespan);
  dds_qset_liveliness(qos.get(), topic.shows_life ? DDS_LIVELINESS_MANUAL_BY_TOPIC : DDS_LIVELINESS_AUTOMATIC,
                      lease);
  // Instances may have writers in two participants; the end of one writer must not end the other's instance.
  dds_qset_writer_data_lifecycle(qos.get(), false);
  return qos;
}

void WriterEnds::run() {
  constexpr std::size_t kMaxThreads = 16;
  std::atomic<std::size_t> next = 0;
  const auto work = [this, &next] {
    for (std::size_t each = next++; each < ends_.size(); each = next++) ends_[each]();
  };
  std::vector<std::jthread> threads;
  try {
    while (threads.size() < std::min(kMaxThreads, ends_.size())) threads.emplace_back(work);
  } catch (const std::system_error&) {  // fewer threads will do
  }
  work();
}

Node::Node(DomainUse domain, const DdsOptions& options)
    : bell_(options.bell != nullptr ? options.bell : std::make_shared<Doorbell>()),
      domain_(std::move(domain)),
      options_(options),
      own_lease_(options.lease.count()),
      lease_(own_lease_) {}

Result<Node> Node::create(const DdsOptions& options, const std::string& name, const std::string& partition,
                          Purpose purpose, Repeat repeat) {
  if (options.domain > kMaxDomain) {
    return fail(ErrorCode::kInvalidArgument, "a DDS domain is 0 to " + std::to_string(kMaxDomain));
  }
  if (options.delta_depth < 1 || options.delta_depth > (1U << 20U)) {
    return fail(ErrorCode::kInvalidArgument, "delta depth must be 1 to 2^20");
  }
  if (options.lease < std::chrono::milliseconds(100)) {
    return fail(ErrorCode::kInvalidArgument, "a lease under 0.1 s declares healthy peers dead");
  }
  without_handshake_deadline();
  auto domain = DomainUse::acquire(options.domain, repeat, options.profile);
  if (!domain) return tl::unexpected(domain.error());
  Node node(std::move(*domain), options);
  if (repeat == Repeat::kSoon) node.lease_ *= kServersAutomaticLeases;

  const Qos named(dds_create_qos());
  dds_qset_entity_name(named.get(), name.c_str());
  std::string with;
  if (!options.secure.empty()) {
    const auto identity = use_identity(options.secure, purpose, named.get());
    if (!identity) return tl::unexpected(identity.error());
    node.may_act_ = identity->role != kObserverRole;
    with = " with the identity in " + options.secure;
  }
  auto participant =
      own(dds_create_participant(options.domain, named.get(), nullptr), "the participant" + with);
  if (!participant) return tl::unexpected(participant.error());
  node.participant_ = std::move(*participant);
  node.call_out_.emplace(node.participant_.get(), steady_ns());
  dds_guid_t guid;
  if (const auto code = dds_get_guid(node.participant_.get(), &guid); code != DDS_RETCODE_OK) {
    return dds_failure("reading the participant's GUID", code);
  }
  node.self_ = to_participant_id(guid);

  auto publisher = node.make_publisher({partition});
  if (!publisher) return tl::unexpected(publisher.error());
  node.publisher_ = std::move(*publisher);
  auto subscriber = node.make_subscriber({partition});
  if (!subscriber) return tl::unexpected(subscriber.error());
  node.subscriber_ = std::move(*subscriber);
  return node;
}

Result<Entity> Node::make_publisher(const std::vector<std::string>& partitions) const {
  return own(dds_create_publisher(participant_.get(), in_partitions(partitions).get(), nullptr),
             "the publisher");
}

Result<Entity> Node::make_subscriber(const std::vector<std::string>& partitions) const {
  return own(dds_create_subscriber(participant_.get(), in_partitions(partitions).get(), nullptr),
             "the subscriber");
}

Result<Entity> Node::make_topic(const dds_topic_descriptor_t& descriptor, const char* name) {
  return own(dds_create_topic(participant_.get(), &descriptor, name, nullptr, nullptr),
             std::string("the topic ") + name);
}

}  // namespace tandem::transport::dds
