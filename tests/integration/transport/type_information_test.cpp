// Works like a type-driven monitoring tool. This process links none of our types: it finds a topic by its
// name, fetches the type from the writer's process and decodes samples with nothing else.

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_xt_impl.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/integration/transport/child.hpp"

namespace tandem::transport {
namespace {

using Fields = std::map<std::string, std::string>;  // "streams[1].codec" -> "tracker"
using TypeId = DDS_XTypes_TypeIdentifier;

constexpr const char* kLoopback =
    "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/>"
    "</Interfaces></General></Domain></CycloneDDS>";

/// Walks a sample of XCDR version 1, little-endian, along its type.
class Decoder {
 public:
  Decoder(dds_entity_t participant, std::vector<unsigned char> sample)
      : participant_(participant), sample_(std::move(sample)) {}

  Fields decode(const TypeId& type) {
    EXPECT_EQ(sample_.at(0), 0);
    EXPECT_EQ(sample_.at(1), 1);
    value(type, "");
    return fields_;
  }
  [[nodiscard]] std::size_t left() const { return sample_.size() - at_; }

 private:
  template <class T>
  T scalar() {
    T value{};
    at_ = (at_ - kHeader + sizeof(T) - 1) / sizeof(T) * sizeof(T) + kHeader;
    if (at_ + sizeof(T) > sample_.size()) throw std::out_of_range("the sample is too short");
    std::memcpy(&value, &sample_[at_], sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  template <class T>
  void number(const std::string& path) {
    std::ostringstream text;
    text << +scalar<T>();
    fields_[path] = text.str();
  }
  void sequence(const TypeId& element, const std::string& path) {
    const auto count = scalar<std::uint32_t>();
    fields_[path] = std::to_string(count);
    for (std::uint32_t i = 0; i < count; ++i) value(element, path + "[" + std::to_string(i) + "]");
  }
  void structure(const TypeId& type, const std::string& path) {
    const dds_typeid_t id{type};
    dds_typeobj_t* object = nullptr;
    if (dds_get_typeobj(participant_, &id, DDS_SECS(5), &object) != DDS_RETCODE_OK) {
      throw std::runtime_error("no type object of " + path);
    }
    EXPECT_EQ(object->x._d, DDS_XTypes_EK_COMPLETE);
    EXPECT_EQ(object->x._u.complete._d, DDS_XTypes_TK_STRUCTURE);
    const auto& members = object->x._u.complete._u.struct_type.member_seq;
    for (std::uint32_t i = 0; i < members._length; ++i) {
      const auto& member = members._buffer[i];
      value(member.common.member_type_id, path + (path.empty() ? "" : ".") + member.detail.name);
    }
    dds_free_typeobj(object);
  }
  void value(const TypeId& type, const std::string& path) {
    switch (type._d) {
      case DDS_XTypes_TK_BYTE:
        return number<std::uint8_t>(path);
      case DDS_XTypes_TK_INT32:
        return number<std::int32_t>(path);
      case DDS_XTypes_TK_UINT32:
        return number<std::uint32_t>(path);
      case DDS_XTypes_TK_INT64:
        return number<std::int64_t>(path);
      case DDS_XTypes_TK_UINT64:
        return number<std::uint64_t>(path);
      case DDS_XTypes_TK_FLOAT32:
        return number<float>(path);
      case DDS_XTypes_TK_FLOAT64:
        return number<double>(path);
      case DDS_XTypes_TI_STRING8_SMALL: {
        for (auto left = scalar<std::uint32_t>(); left > 1; --left) fields_[path] += scalar<char>();
        EXPECT_EQ(scalar<char>(), '\0');
        return;
      }
      case DDS_XTypes_TI_PLAIN_SEQUENCE_SMALL:
        return sequence(*type._u.seq_sdefn.element_identifier, path);
      case DDS_XTypes_EK_COMPLETE:
        return structure(type, path);
      default:
        throw std::runtime_error(path + " is of a kind this decoder does not know");
    }
  }

  static constexpr std::size_t kHeader = 4;  // encapsulation; alignment counts from behind it
  dds_entity_t participant_;
  std::vector<unsigned char> sample_;
  std::size_t at_ = kHeader;
  Fields fields_;
};

class TypeInformation : public ::testing::Test {
 protected:
  TypeInformation() {
    setenv("CYCLONEDDS_URI", kLoopback, 1);
    const auto domain = static_cast<dds_domainid_t>(1 + getpid() % 99);  // beyond, ports are ephemeral ones
    writer_ = std::make_unique<test::Child>(
        std::vector<std::string>{TANDEM_TEST_TOPIC_WRITER, std::to_string(domain)});
    EXPECT_EQ(writer_->line(), "ready");
    participant_ = dds_create_participant(domain, nullptr, nullptr);
    EXPECT_GT(participant_, 0);
  }
  ~TypeInformation() override { dds_delete(participant_); }

  /// The first sample of the topic, decoded.
  Fields read(const std::string& topic) {
    const dds_entity_t publications =
        dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr);
    for (int tries = 0; tries < 1000; ++tries, usleep(10'000)) {
      void* found = nullptr;
      dds_sample_info_t info;
      while (dds_take(publications, &found, &info, 1, 1) == 1) {
        auto* endpoint = static_cast<dds_builtintopic_endpoint_t*>(found);
        Fields fields;
        const bool wanted = info.valid_data && endpoint->topic_name == topic;
        if (wanted) fields = read_from(*endpoint);
        dds_return_loan(publications, &found, 1);
        if (wanted) return fields;
      }
    }
    ADD_FAILURE() << "no writer of " << topic;
    return {};
  }

 private:
  Fields read_from(dds_builtintopic_endpoint_t& endpoint) {
    const dds_typeinfo_t* information = nullptr;
    EXPECT_EQ(dds_builtintopic_get_endpoint_type_info(&endpoint, &information), DDS_RETCODE_OK);
    if (information == nullptr) return {};
    dds_topic_descriptor_t* descriptor = nullptr;
    EXPECT_EQ(dds_create_topic_descriptor(DDS_FIND_SCOPE_GLOBAL, participant_, information, DDS_SECS(5),
                                          &descriptor),
              DDS_RETCODE_OK);
    if (descriptor == nullptr) return {};
    EXPECT_STREQ(descriptor->m_typename, endpoint.type_name);

    dds_qos_t* qos = dds_create_qos();
    dds_qset_partition1(qos, "*");
    const dds_entity_t subscriber = dds_create_subscriber(participant_, qos, nullptr);
    const dds_entity_t topic =
        dds_create_topic(participant_, descriptor, endpoint.topic_name, nullptr, nullptr);
    const dds_entity_t reader = dds_create_reader(subscriber, topic, nullptr, nullptr);
    dds_delete_qos(qos);
    dds_delete_topic_descriptor(descriptor);
    for (int tries = 0; tries < 1000; ++tries, usleep(10'000)) {
      ddsi_serdata* sample = nullptr;
      dds_sample_info_t info;
      if (dds_takecdr(reader, &sample, 1, &info, DDS_ANY_STATE) != 1) continue;
      std::vector<unsigned char> bytes(ddsi_serdata_size(sample));
      ddsi_serdata_to_ser(sample, 0, bytes.size(), bytes.data());
      ddsi_serdata_unref(sample);
      if (!info.valid_data) continue;
      Decoder decoder(participant_, bytes);
      Fields fields = decoder.decode(information->x.complete.typeid_with_size.type_id);
      EXPECT_LT(decoder.left(), 4U);  // padding
      return fields;
    }
    ADD_FAILURE() << "no sample of " << endpoint.topic_name;
    return {};
  }

  std::unique_ptr<test::Child> writer_;
  dds_entity_t participant_ = 0;
};

TEST_F(TypeInformation, AToolReadsTheServersStatusWithoutOurTypes) {
  Fields status = read("TandemServerStatus");
  EXPECT_EQ(status["epoch"], "1700000000123");
  EXPECT_EQ(status["frame"], "4711");
  EXPECT_EQ(status["mbit_per_s"], "1.5");
  EXPECT_EQ(status["bodies"], "10000");
  EXPECT_EQ(status["stream"], "3");
  EXPECT_EQ(status["session"], "arena");
  EXPECT_EQ(status["predictor"], "contact");
}

TEST_F(TypeInformation, AToolReadsStructuresWithinTheAnnouncement) {
  Fields session = read("TandemSession");
  EXPECT_EQ(session["lattice_unit"], "0.000976562");
  EXPECT_EQ(session["session"], "arena");
  EXPECT_EQ(session["types"], "1");
  EXPECT_EQ(session["types[0].name"], "box");
  EXPECT_EQ(session["types[0].shape_values[2]"], "0.5");
  EXPECT_EQ(session["streams"], "2");
  EXPECT_EQ(session["streams[1].id"], "1");
  EXPECT_EQ(session["streams[1].layout_hash"], "18446744073709551615");
  EXPECT_EQ(session["streams[1].groups[1]"], "other");
  EXPECT_EQ(session["streams[1].parameters[1].value"], "-7");
  EXPECT_EQ(session["streams[1].codec_tables[2]"], "250");
  EXPECT_EQ(session["streams[1].name"], "thin");
  EXPECT_EQ(session["gravity_y"], "-9.5");
  EXPECT_EQ(session["names[0].slot"], "7");
  EXPECT_EQ(session["names[0].name"], "crane");
}

}  // namespace
}  // namespace tandem::transport
