// The DDS ports within one process, over loopback.

#include <dds/dds.h>
#include <unistd.h>

#include <limits>
#include <thread>

#include "tests/integration/transport/dds_ports_fixture.hpp"

namespace tandem::transport {
namespace {

using test::a_scheduled_input;
using test::a_snapshot;
using test::an_ack;

// The reader of stream 1 is a bare node, so that nothing is asked of the client's side.
TEST_F(DdsPorts, DeltasOfASecondStreamAreInAPartitionOfTheirOwnAndSnapshotsInThatOfTheirClient) {
  constexpr ClientId kOther = kClient + 1;
  const auto server = this->server();
  const auto client = this->client();
  ASSERT_TRUE(server->open_streams(2));
  const SessionMessage session = join(*server, *client);
  EXPECT_FALSE(server->joined(client->self(), kClient, 1)) << "it reads stream 0 alone";
  EXPECT_FALSE(server->joined(client->self(), kClient, 2));
  ASSERT_TRUE(server->open_client(kOther));
  auto node = dds::Node::create(options_, "reader of stream 1", stream_partition(options_.session, 1),
                                dds::Purpose::kObserve);
  ASSERT_TRUE(node);
  auto deltas = node->reader<DeltaMessage>("deltas");
  auto snapshots = node->reader<SnapshotMessage>(
      "snapshots", {.partitions = {client_partition(options_.session, kOther)}});
  auto inputs = node->reader<ScheduledInputMessage>("scheduled inputs", {.partitions = {options_.session}});
  ASSERT_TRUE(deltas && snapshots && inputs);
  ASSERT_TRUE(eventually([&] { return server->joined(node->self(), kOther, 1); }));
  EXPECT_FALSE(server->joined(node->self(), kOther, 0));
  EXPECT_FALSE(server->joined(client->self(), kOther, 0)) << "the other's snapshots";

  DeltaMessage first = a_delta(kEpoch, 1), second = first;
  second.stream.id = 1;
  ASSERT_TRUE(server->write(first));
  ASSERT_TRUE(server->write(second));
  std::atomic<std::uint64_t> dropped = 0;
  std::vector<Received<DeltaMessage>> got;
  std::vector<Received<SnapshotMessage>> cuts;
  ASSERT_TRUE(eventually([&] {
    SnapshotMessage cut = a_snapshot(kEpoch, 1);
    cut.stream.id = 1;
    EXPECT_TRUE(server->write(kOther, cut));
    deltas->take(dropped, got);
    snapshots->take(dropped, cuts);
    return !got.empty() && !cuts.empty();
  }));
  EXPECT_EQ(got.size(), 1U);
  EXPECT_EQ(got[0].message, second);
  EXPECT_EQ(cuts[0].message.stream.id, 1U);
  const auto of_first = receive<DeltaMessage>(*client, 1);
  EXPECT_EQ(of_first.size(), 1U);
  EXPECT_EQ(of_first[0].message, first);
  std::vector<Received<SnapshotMessage>> none;
  client->take(none);
  EXPECT_TRUE(none.empty());
  second.stream.id = 2;
  EXPECT_EQ(server->write(second).error().code, ErrorCode::kInvalidArgument) << "not open";
  EXPECT_EQ(server->write(kOther + 1, a_snapshot(kEpoch, 1)).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(DdsPorts, SessionNamesWithWildcardsAreRefused) {
  for (const char* name : {"", "*", "a?", "a/b", "a b"}) {
    options_.session = name;
    EXPECT_EQ(make_dds_server_port(options_).error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(make_dds_client_port(options_).error().code, ErrorCode::kInvalidArgument);
  }
}

// Not kInvalidArgument: the same configuration may work a moment later, once an interface is there.
TEST_F(DdsPorts, AConfigurationThatMakesNoDomainIsATransportErrorThatNamesIt) {
  options_.domain = 230;
  for (const char* wrong :
       {"<NoSuchThing/>",
        "<General><Interfaces><NetworkInterface name=\"nowhere0\"/></Interfaces></General>"}) {
    setenv("CYCLONEDDS_URI", (std::string("<CycloneDDS><Domain>") + wrong + "</Domain></CycloneDDS>").c_str(),
           1);
    const auto port = make_dds_server_port(options_);
    ASSERT_FALSE(port);
    EXPECT_EQ(port.error().code, ErrorCode::kTransport);
    EXPECT_NE(port.error().message.find("CYCLONEDDS_URI"), std::string::npos) << port.error().message;
  }
  options_.domain = 231;
  EXPECT_EQ(make_dds_server_port(options_).error().code, ErrorCode::kInvalidArgument);
}

// One process has one domain, and one set of sockets in it.
TEST_F(DdsPorts, AProfileIsTheSameForAllPortsOfAProcessAndStandsAboveTheEnvironment) {
  setenv("CYCLONEDDS_URI", "<CycloneDDS><NoSuchThing/></CycloneDDS>", 1);
  options_.profile = "loopback";
  const auto server = make_dds_server_port(options_);
  ASSERT_TRUE(server) << server.error().message;
  ASSERT_TRUE(make_dds_client_port(options_));
  for (const char* other : {"", "lan"}) {
    options_.profile = other;
    const auto port = make_dds_client_port(options_);
    ASSERT_FALSE(port) << other;
    EXPECT_EQ(port.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(port.error().message.find("with the profile loopback"), std::string::npos)
        << port.error().message;
  }
}

TEST_F(DdsPorts, AServerHasToOpenTheDomainOfAProfileBeforeItsClients) {
  options_.profile = "loopback";
  const auto client = make_dds_client_port(options_);
  ASSERT_TRUE(client) << client.error().message;
  EXPECT_EQ(make_dds_server_port(options_).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(DdsPorts, AProfileThatIsNoneOrNotOfThisMachineIsRefused) {
  options_.profile = "moon";
  EXPECT_EQ(make_dds_client_port(options_).error().code, ErrorCode::kInvalidArgument);
  options_.profile = "lan:interface=nowhere0";
  const auto port = make_dds_client_port(options_);
  EXPECT_EQ(port.error().code, ErrorCode::kTransport) << "the interface may come";
  EXPECT_NE(port.error().message.find("no interface 'nowhere0'"), std::string::npos) << port.error().message;
}

TEST_F(DdsPorts, EveryTopicArrivesAsItWasWritten) {
  const auto server = this->server();
  const auto client = this->client();
  const SessionMessage session = join(*server, *client);
  const auto announced = receive_sessions(*client);
  ASSERT_EQ(announced.size(), 1U);
  EXPECT_EQ(announced[0].message, session);
  EXPECT_EQ(announced[0].from, server->self());

  const DeltaMessage delta = a_delta(kEpoch, 1);
  ASSERT_TRUE(server->write(delta));
  EXPECT_EQ(receive<DeltaMessage>(*client, 1)[0].message, delta);
  const ScheduledInputMessage scheduled = a_scheduled_input(kEpoch, 1);
  ASSERT_TRUE(server->write(scheduled));
  EXPECT_EQ(receive<ScheduledInputMessage>(*client, 1)[0].message, scheduled);
  const SnapshotMessage snapshot = a_snapshot(kEpoch, 6);
  write_until_received(*server, *client, snapshot);
  ReplyMessage reply;
  reply.client = 77;
  reply.epoch = kEpoch;
  reply.role = Role::kParticipant;
  reply.phase = Phase::kPlaying;
  reply.reason = 2;
  reply.highest_input = 40;
  reply.client_clock_ns = -5;
  reply.server_time_ns = 6;
  for (std::uint64_t i = 9; i < 9 + kReplyRing; ++i) reply.entries.push_back(ReplyEntry{i, i * 2, 3});
  ASSERT_TRUE(server->write(reply));
  EXPECT_EQ(receive<ReplyMessage>(*client, 1)[0].message, reply);

  const AckMessage ack = an_ack(77, kEpoch, 5);
  ASSERT_TRUE(client->write(ack));
  const auto acks = receive<AckMessage>(*server, 1);
  EXPECT_EQ(acks[0].message, ack);
  EXPECT_EQ(acks[0].from, client->self());
  InputMessage input;
  input.client = 77;
  input.epoch = kEpoch;
  input.number = 3;
  input.client_frame = 5;
  input.kind = static_cast<std::uint32_t>(InputKind::kPush);
  input.values = {1.5, -2, std::numeric_limits<double>::infinity()};
  input.bytes = Bytes(1024, std::byte{1});
  ASSERT_TRUE(client->write(input));
  EXPECT_EQ(receive<InputMessage>(*server, 1)[0].message, input);
  EXPECT_EQ(server->dropped() + client->dropped(), 0U);
}

TEST_F(DdsPorts, AReplyReachesItsClientAloneOnceThatHasAWriterOfItsOwn) {
  const auto server = this->server();
  const auto owner = this->client();
  const auto other = this->client();
  const SessionMessage session = join(*server, *owner);
  ASSERT_TRUE(other->open_stream(session, session.streams[0], kClient + 1));
  ASSERT_TRUE(other->open_snapshots(0));
  server->close_client(kClient);
  ASSERT_TRUE(eventually([&] {
    ReplyMessage to_all;
    to_all.client = kClient + 1;
    EXPECT_TRUE(server->write(to_all));
    std::vector<Received<ReplyMessage>> got;
    other->wait(10ms);
    other->take(got);
    return !got.empty();
  }));
  std::vector<Received<ReplyMessage>> before;
  owner->take(before);
  ReplyMessage reply;
  reply.client = kClient;
  reply.epoch = kEpoch;
  ASSERT_TRUE(server->write(reply));
  EXPECT_EQ(receive<ReplyMessage>(*owner, 1).at(0).message, reply);
  EXPECT_EQ(receive<ReplyMessage>(*other, 1).at(0).message, reply) << "a stranger's answer is for everybody";
  ASSERT_TRUE(server->open_client(kClient));
  ASSERT_TRUE(server->open_client(kClient)) << "twice is harmless";
  reply.highest_input = 5;
  ASSERT_TRUE(server->write(reply));
  EXPECT_EQ(receive<ReplyMessage>(*owner, 1).at(0).message, reply);
  ReplyMessage last;
  last.client = kClient + 1;
  ASSERT_TRUE(server->write(last));
  EXPECT_EQ(receive<ReplyMessage>(*other, 1).at(0).message, last) << "and nothing before it";

  // A reader that comes late, as in another epoch, is handed what the owner's writer keeps and no more.
  const SessionMessage later = a_session(options_.session, kEpoch + 1);
  ASSERT_TRUE(owner->open_stream(later, later.streams[0], kClient));
  const auto handed = receive<ReplyMessage>(*owner, 2);
  for (const auto& [message, from] : handed) {
    EXPECT_TRUE(message == reply || message == last) << "client " << message.client;
  }
  server->close_client(kClient);
  const SessionMessage latest = a_session(options_.session, kEpoch + 2);
  ASSERT_TRUE(owner->open_stream(latest, latest.streams[0], kClient));
  EXPECT_EQ(receive<ReplyMessage>(*owner, 1).at(0).message, last);
}

TEST_F(DdsPorts, ALateJoinerGetsSessionAndScheduledInputsButNoOldDeltasAndSnapshots) {
  const auto server = this->server();
  const SessionMessage session = a_session(options_.session, kEpoch);
  ASSERT_TRUE(server->write(session));
  for (std::uint64_t number = 1; number <= 300; ++number) {
    ASSERT_TRUE(server->write(a_scheduled_input(kEpoch, number)));
  }
  for (Frame frame = 1; frame <= 20; ++frame) ASSERT_TRUE(server->write(a_delta(kEpoch, frame)));
  ASSERT_TRUE(server->open_client(kClient));
  ASSERT_TRUE(server->write(kClient, a_snapshot(kEpoch, 20)));

  const auto client = this->client();
  EXPECT_EQ(receive_sessions(*client)[0].message, session);
  ASSERT_TRUE(client->open_stream(session, session.streams[0], kClient));
  ASSERT_TRUE(client->open_snapshots(0));
  const auto scheduled = receive<ScheduledInputMessage>(*client, 256);
  ASSERT_EQ(scheduled.size(), 256U) << "keep-last 256";
  for (std::size_t i = 0; i < 256; ++i) EXPECT_EQ(scheduled[i].message.number, 45 + i);
  ASSERT_TRUE(eventually([&] { return server->joined(client->self(), kClient, 0); }));
  write_until_received(*server, *client, a_snapshot(kEpoch, 21));
  ASSERT_TRUE(server->write(a_delta(kEpoch, 21)));
  EXPECT_EQ(receive<DeltaMessage>(*client, 1)[0].message.frame, 21U);
}

TEST_F(DdsPorts, EveryDeltaWrittenAfterJoinedArrives) {
  const auto server = this->server();
  for (int attempt = 0; attempt < 10; ++attempt) {
    const auto client = this->client();
    join(*server, *client);
    for (Frame frame = 1; frame <= 30; ++frame) ASSERT_TRUE(server->write(a_delta(kEpoch, frame)));
    const auto deltas = receive<DeltaMessage>(*client, 30);
    ASSERT_EQ(deltas.size(), 30U);
    for (std::size_t i = 0; i < 30; ++i) EXPECT_EQ(deltas[i].message.frame, i + 1);
  }
}

TEST_F(DdsPorts, TheSameClientIdFromTwoParticipantsIsToldApart) {
  const auto server = this->server();
  const auto first = this->client();
  const auto second = this->client();
  join(*server, *first);
  ASSERT_TRUE(eventually([&] { return server->alive(second->self()); }));
  ASSERT_TRUE(first->write(an_ack(5, kEpoch, 1)));
  EXPECT_EQ(receive<AckMessage>(*server, 1)[0].from, first->self());
  ASSERT_TRUE(second->write(an_ack(5, kEpoch, 2)));
  EXPECT_EQ(receive<AckMessage>(*server, 1)[0].from, second->self());
}

TEST_F(DdsPorts, AFloodUnderAClientsIdPushesOutNoInputOfThatClient) {
  const auto server = this->server();
  const auto owner = this->client();
  const auto flooder = this->client();
  ASSERT_TRUE(eventually([&] { return server->alive(owner->self()) && server->alive(flooder->self()); }));
  InputMessage input;
  input.client = kClient;
  input.epoch = kEpoch;
  for (int i = 0; i < 50; ++i) {
    ++input.number;
    ASSERT_TRUE(owner->write(input));
    for (int flood = 0; flood < 100; ++flood) ASSERT_TRUE(flooder->write(input));
  }
  std::size_t of_owner = 0, of_flooder = 0;
  std::vector<Received<InputMessage>> inputs;
  EXPECT_TRUE(eventually([&] {
    inputs.clear();
    usleep(50'000);  // as a server does that steps meanwhile
    server->take(inputs);
    for (const auto& received : inputs) ++(received.from == owner->self() ? of_owner : of_flooder);
    return of_owner >= 50;
  }));
  EXPECT_EQ(of_owner, 50U);
}

TEST_F(DdsPorts, AnInputThatIsFarTooLargeIsDroppedBeforeItIsRead) {
  const auto server = this->server();
  const auto client = this->client();
  ASSERT_TRUE(eventually([&] { return server->alive(client->self()); }));
  InputMessage input;
  input.client = kClient;
  input.epoch = kEpoch;
  input.number = 1;
  input.bytes.resize(20'000'000);
  ASSERT_TRUE(client->write(input));
  input.bytes.clear();
  input.number = 2;
  ASSERT_TRUE(client->write(input));
  EXPECT_EQ(receive<InputMessage>(*server, 1).at(0).message.number, 2U);
  EXPECT_EQ(server->dropped(), 1U);
}

TEST_F(DdsPorts, AnOfferComesWholeThoughItsRepeatsAreLeftOut) {
  const auto server = this->server();
  const auto client = this->client();
  SessionMessage session = a_session(options_.session, kEpoch);
  session.streams[0].name = "thin";
  session.streams.push_back(session.streams[0]);
  StreamMessage& offer = session.streams.back();
  offer.id.id = 2;
  offer.delay_ms = 200;
  offer.cap_kbit_s = 64;
  const SessionMessage whole = session;
  ASSERT_TRUE(server->write(session));
  const auto received = receive_sessions(*client);
  ASSERT_EQ(received.size(), 1U);
  EXPECT_EQ(received[0].message, whole);
  offer.carries = 7;
  ASSERT_TRUE(server->write(session)) << "an offer of frames that nobody encodes";
  EXPECT_TRUE(eventually([&] {
    std::vector<Received<SessionMessage>> none;
    client->take_sessions(none);
    return client->dropped() > 0;
  }));
}

TEST_F(DdsPorts, SessionsWithDifferentNamesDoNotMeet) {
  const auto server = this->server();
  const auto client = this->client();
  options_.session += "-other";
  const auto stranger = this->client();
  join(*server, *client);
  EXPECT_FALSE(stranger->server_alive());
  EXPECT_FALSE(server->alive(stranger->self()));
}

TEST_F(DdsPorts, OversizeAndMisshapenSamplesAreDroppedAndCounted) {
  const auto server = this->server();
  const auto client = this->client();
  SessionMessage session = join(*server, *client);
  session.streams[0].max_delta_bytes = 1000;
  session.streams[0].max_snapshot_bytes = 2000;
  ASSERT_TRUE(client->open_stream(session, session.streams[0], kClient));
  ASSERT_TRUE(client->open_snapshots(0));
  ASSERT_TRUE(eventually([&] { return server->joined(client->self(), kClient, 0); }));
  ASSERT_TRUE(server->write(a_delta(kEpoch, 1, 1001)));
  DeltaMessage misshapen = a_delta(kEpoch, 2);
  misshapen.part = misshapen.parts = 3;
  ASSERT_TRUE(server->write(misshapen));
  ASSERT_TRUE(server->write(a_delta(kEpoch, 3, 1000)));
  const auto deltas = receive<DeltaMessage>(*client, 1);
  EXPECT_EQ(deltas.at(0).message.frame, 3U);
  EXPECT_EQ(client->dropped(), 2U);

  InputMessage input;
  input.client = 5;
  input.epoch = kEpoch;
  input.number = 1;
  input.bytes = Bytes(1025);
  ASSERT_TRUE(client->write(input));
  input.bytes.clear();
  input.values = std::vector<double>(17);
  ASSERT_TRUE(client->write(input));
  AckMessage ack = an_ack(5, kEpoch, 1);
  ack.phase = static_cast<Phase>(9);
  ASSERT_TRUE(client->write(ack));
  input.values.clear();
  input.number = 2;
  ASSERT_TRUE(client->write(input));
  EXPECT_EQ(receive<InputMessage>(*server, 1).at(0).message.number, 2U);
  ASSERT_TRUE(eventually([&] {
    std::vector<Received<AckMessage>> acks;
    server->take(acks);
    EXPECT_TRUE(acks.empty());
    return server->dropped() == 3;
  }));
}

TEST_F(DdsPorts, DeltasInPartsAndALargeSnapshotArriveWhole) {
  const auto server = this->server();
  const auto client = this->client();
  join(*server, *client);
  for (std::uint32_t part = 0; part < 3; ++part) {
    DeltaMessage delta = a_delta(kEpoch, 1, 200'000 + part);
    delta.part = part;
    delta.parts = 3;
    ASSERT_TRUE(server->write(delta));
  }
  const auto deltas = receive<DeltaMessage>(*client, 3);
  for (std::uint32_t part = 0; part < 3; ++part) {
    EXPECT_EQ(deltas.at(part).message.part, part);
    EXPECT_EQ(deltas.at(part).message.payload.size(), 200'000U + part);
  }
  const SnapshotMessage snapshot = a_snapshot(kEpoch, 5, 1'000'000);
  write_until_received(*server, *client, snapshot);
}

TEST_F(DdsPorts, OpeningTheStreamForAnotherEpochDropsWhatWasBuffered) {
  const auto server = this->server();
  const auto client = this->client();
  SessionMessage session = join(*server, *client);
  ASSERT_TRUE(server->write(a_scheduled_input(kEpoch + 1, 1)));
  ASSERT_TRUE(server->write(a_delta(kEpoch, 1)));
  receive<DeltaMessage>(*client, 1);
  ASSERT_TRUE(server->write(a_delta(kEpoch, 2)));
  session.epoch = kEpoch + 1;
  ASSERT_TRUE(client->open_stream(session, session.streams[0], kClient));
  EXPECT_EQ(receive<ScheduledInputMessage>(*client, 1).at(0).message.epoch, kEpoch + 1);
  std::vector<Received<DeltaMessage>> deltas;
  client->take(deltas);
  EXPECT_TRUE(deltas.empty());
}

TEST_F(DdsPorts, WakeEndsAWaitOfAnotherThread) {
  const auto client = this->client();
  const auto began = std::chrono::steady_clock::now();
  std::thread waker([&] { client->wake(); });
  client->wait(60s);
  waker.join();
  EXPECT_LT(std::chrono::steady_clock::now() - began, 60s) << "it ended by itself";
}

TEST_F(DdsPorts, AParticipantOfTheApplicationOutlivesTheLastPort) {
  auto client = this->client();
  const dds_entity_t own = dds_create_participant(options_.domain, nullptr, nullptr);
  ASSERT_GT(own, 0);
  client.reset();
  dds_guid_t guid{};
  EXPECT_EQ(dds_get_guid(own, &guid), DDS_RETCODE_OK);
  EXPECT_EQ(dds_delete(own), DDS_RETCODE_OK);
}

}  // namespace
}  // namespace tandem::transport
