// Who lives, and what tells of it, over the DDS ports.

#include <unistd.h>

#include <thread>

#include "sdk/transport/dds/peers.hpp"
#include "sdk/wire/units.hpp"
#include "tandem.h"  // generated from idl/tandem.idl
#include "tests/integration/transport/dds_ports_fixture.hpp"

namespace tandem::transport {
namespace {

// The user data with which a participant was announced last; 0: none.
int announcements(dds_entity_t participants, const ParticipantId& of) {
  void* samples[64] = {};
  dds_sample_info_t infos[64];
  const dds_return_t count = dds_read(participants, samples, infos, 64, 64);
  int announced = 0;
  for (int i = 0; i < count; ++i) {
    const auto* const sample = static_cast<const dds_builtintopic_participant_t*>(samples[i]);
    void* data = nullptr;
    std::size_t size = 0;
    if (dds::to_participant_id(sample->key) == of && dds_qget_userdata(sample->qos, &data, &size) && size > 0)
      announced = static_cast<const std::uint8_t*>(data)[0];
    dds_free(data);
  }
  if (count > 0) static_cast<void>(dds_return_loan(participants, samples, count));
  return announced;
}

TEST_F(DdsPorts, AClientAnnouncesItselfAgainUntilItFindsAServer) {
  auto listener = dds::Node::create(options_, "listener", options_.session, dds::Purpose::kWatch);
  ASSERT_TRUE(listener);
  const auto participants = dds::make_participant_reader(listener->participant());
  ASSERT_TRUE(participants);
  const auto client = this->client();
  std::vector<Received<SessionMessage>> none;
  ASSERT_TRUE(eventually([&] {
    client->take_sessions(none);
    return announcements(participants->get(), client->self()) >= 2;
  }));
  const auto server = this->server();
  join(*server, *client);
  receive_sessions(*client);
  const int before = announcements(participants->get(), client->self());
  const auto until = std::chrono::steady_clock::now() + 2500ms;
  while (std::chrono::steady_clock::now() < until) {
    server->show_life();
    client->take_sessions(none);
  }
  EXPECT_LE(announcements(participants->get(), client->self()), before + 1) << "one may have been under way";
}

TEST_F(DdsPorts, AServerOfAnotherVersionIsNamed) {
  auto node = dds::Node::create(options_, "old server", options_.session, dds::Purpose::kServe);
  ASSERT_TRUE(node);
  // Another type under the topic's name, as an older version has.
  const dds::Entity topic(dds_create_topic(node->participant().get(), &tandem_TandemCommand_desc,
                                           SessionMessage::kTopic, nullptr, nullptr));
  const char* partition = options_.session.c_str();
  const dds::Qos qos(dds_create_qos());
  dds_qset_partition(qos.get(), 1, &partition);
  const dds::Entity publisher(dds_create_publisher(node->participant().get(), qos.get(), nullptr));
  const dds::Qos reliable = dds::make_qos(dds::Topic<SessionMessage>::kQos, 1, options_.lease.count());
  const dds::Entity writer(dds_create_writer(publisher.get(), topic.get(), reliable.get(), nullptr));
  ASSERT_GT(writer.get(), 0);
  const auto client = this->client();
  const auto told = [&](const std::string& what) {
    client->server_alive();
    return client->trouble().find(what) != std::string::npos;
  };
  EXPECT_TRUE(eventually([&] { return told("another version of Tandem"); }));
  const auto server = this->server();
  join(*server, *client);
  EXPECT_TRUE(eventually([&] {
    server->show_life();
    client->server_alive();
    return client->trouble().empty();
  })) << "one of this version is there, too";
}

TEST_F(DdsPorts, AnAnnouncementOutOfTurnHasItsTime) {
  auto node = dds::Node::create(options_, "caller", options_.session, dds::Purpose::kWatch);
  ASSERT_TRUE(node);
  const auto participants = dds::make_participant_reader(node->participant());
  ASSERT_TRUE(participants);
  dds::CallOut call_out(node->participant().get(), 0);
  int made = 0;
  for (std::int64_t now_ns = 0; now_ns <= 20 * kSecond; now_ns += kSecond / 10) {
    call_out.again(now_ns);
    made = announcements(participants->get(), node->self());
    if (now_ns < kSecond) {
      EXPECT_EQ(made, 0) << "it has just been announced";
    }
  }
  EXPECT_EQ(made, 6 + 2) << "after 1 to 6 s, and then every 5 s";
  EXPECT_FALSE(call_out.began_lately(20 * kSecond));
}

TEST_F(DdsPorts, AMonitorSeesTheStatusOfEverySession) {
  const auto monitor = make_dds_monitor(options_);
  ASSERT_TRUE(monitor);
  const auto server = this->server();
  const auto client = this->client();
  join(*server, *client);
  ServerStatusMessage server_status;
  server_status.session = options_.session;
  server_status.epoch = kEpoch;
  server_status.frame = 12;
  server_status.mbit_per_s = 1.25;
  server_status.snapshots = 3;
  server_status.queue_high_water = 2;
  ClientStatusMessage client_status;
  client_status.client = 77;
  client_status.session = options_.session;
  client_status.lag_ms = 3.5;
  client_status.resyncs = 1;
  std::vector<Stamped<ServerStatusMessage>> servers;
  std::vector<Stamped<ClientStatusMessage>> clients;
  EXPECT_TRUE(eventually([&] {  // best effort: repeated, as the programs do
    EXPECT_TRUE(server->write(server_status));
    EXPECT_TRUE(client->write(client_status));
    (*monitor)->wait(10ms);
    (*monitor)->take(servers);
    (*monitor)->take(clients);
    return !servers.empty() && !clients.empty();
  }));
  EXPECT_EQ(servers.at(0).message, server_status);
  EXPECT_EQ(servers.at(0).from, server->self());
  EXPECT_EQ(clients.at(0).message, client_status);
  EXPECT_GT(clients.at(0).written_ns, 0);
  const auto peer = (*monitor)->describe(clients.at(0).from);
  ASSERT_TRUE(peer);
  EXPECT_EQ(peer->name.rfind("tandem client", 0), 0U) << peer->name;
  EXPECT_FALSE(peer->host.empty());
  EXPECT_EQ(peer->pid, std::to_string(::getpid()));
  EXPECT_EQ(peer->lease, options_.lease / 2);
  EXPECT_FALSE((*monitor)->describe(ParticipantId{}));
  std::vector<Received<SessionMessage>> sessions;
  EXPECT_TRUE(eventually([&] {
    (*monitor)->list_sessions(sessions);
    return !sessions.empty();
  }));
  EXPECT_EQ(sessions.at(0).message.session, options_.session);
}

// Best effort, so the counts are compared with what was written.
TEST_F(DdsPorts, AClientHearsTheFiguresOfAStreamOnceAndThenWhenTheyChange) {
  const auto monitor = make_dds_monitor(options_);
  ASSERT_TRUE(monitor);
  const auto server = this->server();
  const auto client = this->client();
  join(*server, *client);
  ServerStatusMessage status;
  status.session = options_.session;
  status.epoch = kEpoch;
  status.mbit_per_s = 1;
  std::vector<Received<ServerStatusMessage>> heard;
  std::vector<Stamped<ServerStatusMessage>> watched;
  const auto write_for = [&](std::chrono::milliseconds time) {
    heard.clear(), watched.clear();
    for (const auto end = std::chrono::steady_clock::now() + time; std::chrono::steady_clock::now() < end;) {
      EXPECT_TRUE(server->write(status));
      std::this_thread::sleep_for(20ms);
      static_cast<void>(client->server_alive());
      client->take(heard);
      (*monitor)->take(watched);
    }
  };
  write_for(3500ms);  // somebody new is told each time for 3 s
  EXPECT_GT(heard.size(), 10U);
  write_for(1000ms);
  EXPECT_EQ(heard.size(), 0U);
  EXPECT_GT(watched.size(), 10U);
  std::this_thread::sleep_for(7000ms);
  status.mbit_per_s = 2;
  write_for(1000ms);
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_EQ(heard[0].message.mbit_per_s, 2);
}

TEST_F(DdsPorts, AServerThatWritesNothingLivesAsLongAsItShowsIt) {
  const auto server = this->server();
  const auto client = this->client();
  const SessionMessage session = join(*server, *client);
  ASSERT_FALSE(receive_sessions(*client).empty());
  const auto shows_life_for = [&](std::chrono::nanoseconds time) {
    for (const auto end = std::chrono::steady_clock::now() + time; std::chrono::steady_clock::now() < end;) {
      server->show_life();
      std::this_thread::sleep_for(50ms);
      if (!client->server_alive()) return false;
    }
    return true;
  };
  EXPECT_TRUE(shows_life_for(3 * options_.lease));
  EXPECT_TRUE(eventually([&] { return !client->server_alive(); }));
  EXPECT_FALSE(client->server_ended()) << "it may come back";
  EXPECT_TRUE(server->write(a_delta(session.epoch, 1)));
  EXPECT_TRUE(eventually([&] { return client->server_alive(); }));
}

TEST_F(DdsPorts, JoinedNeedsAllThreeReadersAndAliveEndsWithThePort) {
  const auto server = this->server();
  auto client = this->client();
  const ParticipantId id = client->self();
  const SessionMessage session = a_session(options_.session, kEpoch);
  ASSERT_TRUE(eventually([&] { return server->alive(id); }));
  EXPECT_FALSE(server->joined(id, kClient, 0));
  ASSERT_TRUE(server->open_client(kClient));
  ASSERT_TRUE(client->open_stream(session, session.streams[0], kClient));
  ASSERT_TRUE(client->open_snapshots(0));
  ASSERT_TRUE(eventually([&] { return server->joined(id, kClient, 0); }));
  client->close_stream(0);
  EXPECT_TRUE(eventually([&] { return !server->joined(id, kClient, 0); }));
  client.reset();
  EXPECT_TRUE(eventually([&] { return !server->alive(id); }));
}

TEST_F(DdsPorts, AServerSeesOthersButNotItself) {
  const auto first = this->server();
  const auto second = this->server();
  ASSERT_TRUE(first->write(a_session(options_.session, kEpoch)));
  ASSERT_TRUE(second->write(a_session(options_.session, kEpoch + 1)));
  const auto seen_by_first = receive_sessions(*first);
  ASSERT_EQ(seen_by_first.size(), 1U);
  EXPECT_EQ(seen_by_first[0].from, second->self());
  const auto seen_by_second = receive_sessions(*second);
  ASSERT_EQ(seen_by_second.size(), 1U);
  EXPECT_EQ(seen_by_second[0].from, first->self());
}

TEST_F(DdsPorts, WhatOtherServersSayDoesNotWakeAServer) {
  const auto first = server();
  const auto other = server();
  auto monitor = make_dds_monitor(options_);
  ASSERT_TRUE(monitor);
  ServerStatusMessage status;
  status.session = options_.session;
  std::vector<Stamped<ServerStatusMessage>> heard;
  EXPECT_TRUE(eventually([&] {
    EXPECT_TRUE(other->write(status));
    (*monitor)->take(heard);
    return heard.size() >= 5;
  }));
  // A sample that waits to be taken would end every wait at once.
  std::size_t waits = 0;
  for (const auto end = std::chrono::steady_clock::now() + 200ms; std::chrono::steady_clock::now() < end;) {
    first->wait(50ms);
    ++waits;
  }
  EXPECT_LT(waits, 100U);
}

TEST_F(DdsPorts, AClientStaysWithItsServerAndIsToldOfAnotherWhenThatEnds) {
  auto ends = this->server();
  const auto stays = this->server();
  const auto client = this->client();
  const SessionMessage session = a_session(options_.session, kEpoch);
  ASSERT_TRUE(ends->write(session));
  EXPECT_EQ(receive_sessions(*client)[0].message.epoch, kEpoch);
  ASSERT_TRUE(client->open_stream(session, session.streams[0], kClient));
  ASSERT_TRUE(stays->write(a_session(options_.session, kEpoch + 1)));
  receive_sessions(*ends);  // by now others have heard of it, too
  std::vector<Received<SessionMessage>> news;
  client->take_sessions(news);
  EXPECT_TRUE(news.empty());
  EXPECT_TRUE(client->server_alive());
  ends.reset();
  EXPECT_TRUE(eventually([&] { return !client->server_alive(); }));
  EXPECT_EQ(receive_sessions(*client)[0].message.epoch, kEpoch + 1);
}

}  // namespace
}  // namespace tandem::transport
