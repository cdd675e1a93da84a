// Our bytes of a message are those that Cyclone DDS makes of the same message, and it reads ours.

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <gtest/gtest.h>

#include "sdk/transport/dds/lend.hpp"
#include "sdk/transport/dds/topics.hpp"
#include "sdk/wire/cdr.hpp"
#include "tests/integration/transport/loopback.hpp"
#include "tests/unit/transport/random_messages.hpp"

namespace tandem::transport {
namespace {

using dds::Entity;
using test::eventually;

template <class M>
class DdsCdr : public ::testing::Test {
 protected:
  DdsCdr() {
    const DdsOptions options = test::loopback();
    participant_ = Entity(dds_create_participant(options.domain, nullptr, nullptr));
    topic_ = Entity(
        dds_create_topic(participant_.get(), &dds::Topic<M>::descriptor(), M::kTopic, nullptr, nullptr));
    const dds::Qos qos = dds::make_qos({true, true, 1, 1}, 1, DDS_INFINITY);
    writer_ = Entity(dds_create_writer(participant_.get(), topic_.get(), qos.get(), nullptr));
    reader_ = Entity(dds_create_reader(participant_.get(), topic_.get(), qos.get(), nullptr));
  }
  /// The bytes that Cyclone DDS makes of a message, with its header.
  Bytes cyclones(const M& message) {
    EXPECT_EQ(dds::write_sample(writer_.get(), message), DDS_RETCODE_OK);
    ddsi_serdata* sample = nullptr;
    dds_sample_info_t info;
    EXPECT_TRUE(
        eventually([&] { return dds_takecdr(reader_.get(), &sample, 1, &info, DDS_ANY_STATE) == 1; }));
    if (sample == nullptr) return {};
    Bytes bytes(ddsi_serdata_size(sample));
    ddsi_serdata_to_ser(sample, 0, bytes.size(), bytes.data());
    // The same type, but our bytes.
    Bytes ours;
    write_cdr(message, ours);
    ours.resize((ours.size() + 3) / 4 * 4);  // as RTPS has it
    const ddsrt_iovec_t part{ours.data(), ours.size()};
    reread_ = ddsi_serdata_from_ser_iov(sample->type, SDK_DATA, 1, &part, ours.size());
    ddsi_serdata_unref(sample);
    return bytes;
  }
  /// Cyclone's reading of our bytes of the message before.
  M reread() {
    EXPECT_NE(reread_, nullptr) << "Cyclone DDS refuses our bytes";
    if (reread_ == nullptr) return {};
    Bytes bytes(ddsi_serdata_size(reread_));
    ddsi_serdata_to_ser(reread_, 0, bytes.size(), bytes.data());
    ddsi_serdata_unref(std::exchange(reread_, nullptr));
    const auto message = read_cdr<M>(bytes, Padding::kAny);
    EXPECT_TRUE(message);
    return message ? *message : M{};
  }

 private:
  Entity participant_, topic_, writer_, reader_;
  ddsi_serdata* reread_ = nullptr;
};

using Messages =
    ::testing::Types<SessionMessage, DeltaMessage, ScheduledInputMessage, SnapshotMessage, ReplyMessage,
                     InputMessage, AckMessage, ServerStatusMessage, ClientStatusMessage, JournalMessage,
                     CheckpointMessage, StandbyMessage, CommandMessage>;
TYPED_TEST_SUITE(DdsCdr, Messages);

TYPED_TEST(DdsCdr, OurBytesAreThoseOfCycloneDds) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const auto message = RandomMessages(seed).make<TypeParam>();
    Bytes ours;
    write_cdr(message, ours);
    const Bytes theirs = this->cyclones(message);
    ASSERT_GE(theirs.size(), ours.size());
    // The options count the bytes that fill up the last word; captures have neither.
    EXPECT_EQ(theirs.size() - ours.size(), (4 - ours.size() % 4) % 4);
    EXPECT_EQ(theirs[0], ours[0]);
    EXPECT_EQ(theirs[1], ours[1]);
    EXPECT_EQ(
        Bytes(theirs.begin() + kCdrHeaderBytes, theirs.begin() + static_cast<std::ptrdiff_t>(ours.size())),
        Bytes(ours.begin() + kCdrHeaderBytes, ours.end()));
    const auto read = read_cdr<TypeParam>(theirs);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(*read, message);
    EXPECT_EQ(this->reread(), message);
  }
}

}  // namespace
}  // namespace tandem::transport
