// Watches a session with another vendor's DDS: Fast DDS, with code that fastddsgen made from idl/tandem.idl.
// Nothing of Tandem is linked.
//
//   fastdds_subscriber DOMAIN SESSION
//
// Stays on the loopback interface. Prints one JSON object a line: a status when it comes, "matched" when
// there is a writer of deltas, and, when stdin ends, the sums of all deltas that came. Exit 0, or 1 if DDS
// refuses.

#include <poll.h>
#include <unistd.h>

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <tandemPubSubTypes.h>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>

namespace fast = eprosima::fastdds::dds;
using eprosima::fastrtps::types::ReturnCode_t;

namespace {

std::mutex output;

void print(const std::string& line) {
  const std::scoped_lock lock(output);
  std::puts(line.c_str());
  std::fflush(stdout);
}

/// Takes every sample of a reader, in a thread of Fast DDS.
template <typename Sample>
class Takes : public fast::DataReaderListener {
 public:
  void on_data_available(fast::DataReader* reader) override {
    Sample sample;
    fast::SampleInfo info;
    while (reader->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK)
      if (info.valid_data) take(sample);
  }

 private:
  virtual void take(const Sample& sample) = 0;
};

class Statuses final : public Takes<tandem::TandemServerStatus> {
  void take(const tandem::TandemServerStatus& status) override {
    char line[512];
    std::snprintf(
        line, sizeof line,
        R"({"status":"%s","epoch":%)" PRIu64 R"(,"frame":%)" PRIu64
        R"(,"frame_rate_hz":%.2f,"mbit_per_s":%.3f,"bodies":%u,"participants":%u,"delta_bytes":%)" PRIu64
        R"(,"codec":"%s","predictor":"%s"})",
        status.session().c_str(), status.epoch(), status.frame(), status.frame_rate_hz(), status.mbit_per_s(),
        status.bodies(), status.participants(), status.delta_bytes(), status.codec().c_str(),
        status.predictor().c_str());
    print(line);
  }
};

class Deltas final : public Takes<tandem::TandemDelta> {
 public:
  [[nodiscard]] std::string sums() {
    const std::scoped_lock lock(mutex_);
    char line[256];
    const std::uint64_t first = frames_.empty() ? 0 : *frames_.begin();
    const std::uint64_t last = frames_.empty() ? 0 : *frames_.rbegin();
    std::snprintf(line, sizeof line,
                  R"({"frames":%zu,"first_frame":%)" PRIu64 R"(,"last_frame":%)" PRIu64 R"(,"parts":%)" PRIu64
                  R"(,"delta_bytes":%)" PRIu64 "}",
                  frames_.size(), first, last, parts_, bytes_);
    return line;
  }

 private:
  void take(const tandem::TandemDelta& delta) override {
    const std::scoped_lock lock(mutex_);
    for (uint64_t frame = delta.frame() - delta.earlier(); frame <= delta.frame(); ++frame)
      frames_.insert(frame);
    ++parts_;
    bytes_ += delta.payload().size();
  }
  void on_subscription_matched(fast::DataReader* /*reader*/,
                               const fast::SubscriptionMatchedStatus& status) override {
    if (status.current_count_change > 0) print(R"({"matched":true})");
  }

  std::mutex mutex_;
  std::set<std::uint64_t> frames_;
  std::uint64_t parts_ = 0, bytes_ = 0;
};

/// Makes a reader as PROTOCOL.md says, "Other vendors' DDS": no type information, memory that grows, no
/// limits. False: DDS refused.
bool make_reader(fast::DomainParticipant& participant, fast::Subscriber& subscriber,
                 fast::TopicDataType* type, const std::string& name, bool reliable, std::int32_t depth,
                 fast::DataReaderListener& listener) {
  const fast::TypeSupport support(type);
  support->auto_fill_type_information(false);
  support->auto_fill_type_object(false);
  if (support.register_type(&participant) != ReturnCode_t::RETCODE_OK) return false;
  fast::Topic* const topic = participant.create_topic(name, support.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  if (topic == nullptr) return false;
  fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
  qos.reliability().kind = reliable ? fast::RELIABLE_RELIABILITY_QOS : fast::BEST_EFFORT_RELIABILITY_QOS;
  qos.history().depth = depth;
  auto& limits = qos.resource_limits();
  limits.max_samples = limits.max_instances = limits.max_samples_per_instance = 0;
  limits.allocated_samples = 16;
  qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  return subscriber.create_datareader(topic, qos, &listener) != nullptr;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: fastdds_subscriber DOMAIN SESSION\n", stderr);
    return 2;
  }
  auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  transport->interfaceWhiteList.emplace_back("127.0.0.1");
  fast::DomainParticipantQos participant_qos = fast::PARTICIPANT_QOS_DEFAULT;
  participant_qos.name("fastdds_subscriber");
  participant_qos.transport().use_builtin_transports = false;
  participant_qos.transport().user_transports.push_back(transport);
  const auto domain = static_cast<std::uint32_t>(std::strtoul(argv[1], nullptr, 10));
  fast::DomainParticipantFactory& factory = *fast::DomainParticipantFactory::get_instance();
  fast::DomainParticipant* const participant = factory.create_participant(domain, participant_qos);
  if (participant == nullptr) {
    std::fputs("fastdds_subscriber: no DDS participant could be made\n", stderr);
    return 1;
  }
  fast::SubscriberQos subscriber_qos = fast::SUBSCRIBER_QOS_DEFAULT;
  subscriber_qos.partition().push_back(argv[2]);
  fast::Subscriber* const subscriber = participant->create_subscriber(subscriber_qos);
  Statuses statuses;
  Deltas deltas;
  const bool made = subscriber != nullptr &&
                    make_reader(*participant, *subscriber, new tandem::TandemServerStatusPubSubType,
                                "TandemServerStatus", false, 1, statuses) &&
                    make_reader(*participant, *subscriber, new tandem::TandemDeltaPubSubType, "TandemDelta",
                                true, 4096, deltas);
  if (made) {
    char byte = 0;
    while (::read(STDIN_FILENO, &byte, 1) > 0) {
    }
    print(deltas.sums());
  } else {
    std::fputs("fastdds_subscriber: a reader could not be made\n", stderr);
  }
  participant->delete_contained_entities();
  factory.delete_participant(participant);
  return made ? 0 : 1;
}
