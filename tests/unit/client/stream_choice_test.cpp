#include "sdk/client/session/stream_choice.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sdk/client/core_options.hpp"

namespace tandem::client::of_stream_choice {
namespace {

constexpr double kPeriodNs = 33'333'333;
constexpr double kMs = 1e6;

/// As a server announces them: a thin stream of many bits, a rich one whose step is dear.
std::vector<StreamOffer> thin_and_rich(double thin_ms = 0.05, double rich_ms = 0.7) {
  constexpr double kBodies = 10'000;
  return {{.index = 0,
           .id = {0, 0},
           .name = "thin",
           .is_ballistic = true,
           .threshold = 4096,
           .per_body_ns = thin_ms * kMs / kBodies,
           .announced_ns = thin_ms * kMs},
          {.index = 1,
           .id = {1, 0},
           .name = "rich",
           .threshold = 4096,
           .per_body_ns = rich_ms * kMs / kBodies,
           .announced_ns = rich_ms * kMs}};
}

transport::ServerStatusMessage rate(std::uint32_t stream, double mbit_per_s) {
  transport::ServerStatusMessage status;
  status.stream = stream;
  status.mbit_per_s = mbit_per_s;
  return status;
}

/// A chooser and what it sees, second by second.
class Watched {
 public:
  explicit Watched(const std::string& prefer = "auto", std::optional<double> own_step_ns = std::nullopt,
                   std::vector<StreamOffer> offers = thin_and_rich())
      : chooser(std::move(offers), read_preference(prefer), kPeriodNs, own_step_ns) {
    static_cast<void>(chooser.reconsider({.now_ns = now_ns}));
  }

  /// Frames of the chosen stream take `thin_ms` or `rich_ms` and come at `rate_hz`. Counts the changes.
  int pass(int seconds, double thin_ms, double rich_ms, double rate_hz = 30, double round_trip_ms = 20) {
    int changes = 0;
    for (int i = 0; i < seconds; ++i) {
      const double cost_ms = name() == "thin" ? thin_ms : rich_ms;
      for (int frame = 0; frame < static_cast<int>(rate_hz); ++frame)
        chooser.on_frame(static_cast<std::int64_t>(cost_ms * kMs));
      now_ns += kSecond;
      if (chooser.reconsider(
              {.now_ns = now_ns, .round_trip_ns = static_cast<std::int64_t>(round_trip_ms * kMs)}))
        ++changes;
    }
    return changes;
  }
  [[nodiscard]] const std::string& name() const { return chooser.chosen().name; }

  std::int64_t now_ns = 1000 * kSecond;
  StreamChooser chooser;
};

TEST(StreamChoice, APreferenceIsReadFromText) {
  using Kind = StreamPreference::Kind;
  EXPECT_EQ(read_preference("").kind, Kind::kAutomatic);
  EXPECT_EQ(read_preference("auto").kind, Kind::kAutomatic);
  EXPECT_EQ(read_preference("bandwidth").kind, Kind::kBandwidth);
  EXPECT_EQ(read_preference("computing").kind, Kind::kComputing);
  EXPECT_EQ(read_preference("error").kind, Kind::kError);
  EXPECT_EQ(read_preference("rich").kind, Kind::kNamed);
  EXPECT_EQ(read_preference("rich").name, "rich");
}

TEST(StreamChoice, AFastMachineTakesTheFewestBits) {
  EXPECT_EQ(Watched("auto", 5.0).name(), "rich");
  EXPECT_EQ(Watched("bandwidth", 5.0).name(), "rich");
  EXPECT_EQ(Watched("computing", 5.0).name(), "thin");
}

TEST(StreamChoice, ASlowMachineTakesTheCheapestStep) {
  EXPECT_EQ(Watched("auto", 40.0).name(), "thin") << "8 times slower: 5.6 of 33 ms for the rich one";
  EXPECT_EQ(Watched("bandwidth", 40.0).name(), "rich") << "but it keeps up";
  EXPECT_EQ(Watched("bandwidth", 400.0).name(), "thin");
}

TEST(StreamChoice, WithoutAClockTheServersOwnCostsCount) {
  EXPECT_EQ(measure_own_step(nullptr), std::nullopt);
  EXPECT_EQ(measure_own_step([]() -> std::int64_t { return 77; }), std::nullopt) << "a clock that stands";
  EXPECT_EQ(Watched("auto", std::nullopt).name(), "rich");
  EXPECT_EQ(Watched("auto", std::nullopt, thin_and_rich(0.05, 9)).name(), "thin");
}

TEST(StreamChoice, SmallestErrorIsTakenWhereItIsWanted) {
  auto offers = thin_and_rich();
  offers[0].threshold = 1024;
  EXPECT_EQ(Watched("error", 5.0, offers).name(), "thin");
  EXPECT_EQ(Watched("auto", 5.0, offers).name(), "rich");
}

TEST(StreamChoice, ANamedStreamIsKeptWhateverItCosts) {
  Watched watched("rich", 400.0);
  EXPECT_EQ(watched.name(), "rich");
  EXPECT_EQ(watched.pass(100, 1, 100), 0);
}

TEST(StreamChoice, ANameThatIsNotThereIsSaid) {
  const Watched watched("velvet", 5.0);
  EXPECT_EQ(watched.name(), "rich");
  EXPECT_NE(watched.chooser.reason().find("no stream 'velvet'"), std::string::npos)
      << watched.chooser.reason();
}

TEST(StreamChoice, AStreamThatTakesTooLongIsLeftAndNotTakenAgainSoon) {
  Watched watched;
  ASSERT_EQ(watched.name(), "rich");
  EXPECT_EQ(watched.pass(2, 2, 25), 0) << "a moment is no reason";
  EXPECT_EQ(watched.pass(2, 2, 25), 1);
  EXPECT_EQ(watched.name(), "thin");
  EXPECT_NE(watched.chooser.reason().find("a frame of rich takes 25.0 of 33.3 ms"), std::string::npos)
      << watched.chooser.reason();
  EXPECT_EQ(watched.pass(50, 2, 25), 0) << "what it took is remembered";
  EXPECT_LE(watched.pass(550, 2, 25), 6) << "and tried again after 1, 2, 4 minutes";
  EXPECT_EQ(watched.name(), "thin");
}

TEST(StreamChoice, AFrameNowAndThenIsNoReason) {
  Watched watched;
  for (int i = 0; i < 100; ++i) {
    watched.chooser.on_frame(static_cast<std::int64_t>(90 * kMs));
    EXPECT_EQ(watched.pass(1, 1, 1), 0);
  }
}

TEST(StreamChoice, AFasterRateIsTakenOnceItIsKnown) {
  Watched watched("auto", 40.0);  // thin: the other would take 5.6 ms
  watched.chooser.on_status(rate(0, 0.3));
  watched.chooser.on_status(rate(1, 0.07));
  EXPECT_EQ(watched.pass(300, 1, 5.6), 0);
  Watched wide("bandwidth", 400.0);  // thin, as the other would take 56 ms
  EXPECT_EQ(wide.pass(300, 1, 5.6), 0);
}

TEST(StreamChoice, AStreamThatTurnsOutToTakeMoreBitsIsLeft) {
  Watched watched;  // rich, by what its step promises
  watched.chooser.on_status(rate(0, 0.1));
  watched.chooser.on_status(rate(1, 0.3));
  EXPECT_EQ(watched.pass(15, 1, 1), 0) << "not so soon";
  EXPECT_EQ(watched.pass(15, 1, 1), 1);
  EXPECT_EQ(watched.name(), "thin");
  watched.chooser.on_status(rate(1, 0.09));
  EXPECT_EQ(watched.pass(50, 1, 1), 0) << "hardly better is no reason";
}

TEST(StreamChoice, TheFirstChoiceWantsAStatusOfEachStreamThatMayWin) {
  Watched watched;
  EXPECT_TRUE(watched.chooser.wants_status());
  watched.chooser.on_status(rate(0, 0.03));
  EXPECT_TRUE(watched.chooser.wants_status());
  watched.chooser.on_status(rate(1, 0.22));
  EXPECT_FALSE(watched.chooser.wants_status());
  watched.chooser.choose_anew();
  EXPECT_EQ(watched.name(), "thin") << "a dearer step does not save bits";
}

TEST(StreamChoice, WhereBitsDoNotDecideNoStatusIsWanted) {
  EXPECT_FALSE(Watched("computing").chooser.wants_status());
  EXPECT_FALSE(Watched("rich").chooser.wants_status());
  EXPECT_FALSE(Watched("auto", 40.0).chooser.wants_status()) << "one alone is easy";
  EXPECT_TRUE(Watched("bandwidth", 40.0).chooser.wants_status());
  EXPECT_TRUE(Watched("velvet").chooser.wants_status()) << "no such name: chosen automatically";
}

TEST(StreamChoice, AThinLinkGetsFewerBits) {
  Watched watched("computing");
  ASSERT_EQ(watched.name(), "thin");
  EXPECT_EQ(watched.pass(10, 1, 1), 0);
  EXPECT_EQ(watched.pass(10, 1, 1, 15), 0) << "a server that is slow, or waits for others";
  EXPECT_EQ(watched.pass(10, 1, 1, 15, 400), 1) << "what is sent waits on the way";
  EXPECT_EQ(watched.name(), "rich");
  EXPECT_NE(watched.chooser.reason().find("too thin for thin"), std::string::npos);
}

TEST(StreamChoice, ALinkIsNoReasonForAStreamThatTheProcessorCannotFollow) {
  Watched watched("computing", 400.0);  // 80 times slower: the rich one would take 56 ms
  for (int i = 0; i < 20; ++i) {
    watched.chooser.on_loss(watched.now_ns);
    watched.chooser.on_loss(watched.now_ns);
    EXPECT_EQ(watched.pass(10, 3, 56), 0);
  }
}

TEST(StreamChoice, AStreamThatCannotBeAffordedIsLeftAfterASecondWhateverTheServerAnnounces) {
  Watched watched("computing", std::nullopt, thin_and_rich(0.05, 0.04));
  ASSERT_EQ(watched.name(), "rich") << "the cheapest, says the server";
  EXPECT_EQ(watched.pass(1, 1, 140), 1);
  EXPECT_EQ(watched.name(), "thin");
  EXPECT_EQ(watched.pass(50, 1, 140), 0);
}

TEST(StreamChoice, ASlowProcessorGoesBackEvenToWhatTheLinkWasLeftFor) {
  Watched watched("computing");
  watched.chooser.on_loss(watched.now_ns);
  watched.chooser.on_loss(watched.now_ns);
  ASSERT_EQ(watched.pass(2, 1, 25), 1);
  ASSERT_EQ(watched.name(), "rich");
  EXPECT_EQ(watched.pass(10, 1, 25), 1);
  EXPECT_EQ(watched.name(), "thin");
}

TEST(StreamChoice, WhatAStreamTookOnceIsForgottenWithItsBar) {
  Watched watched;
  ASSERT_EQ(watched.pass(4, 1, 25), 1) << "a processor that was hot";
  ASSERT_EQ(watched.name(), "thin");
  EXPECT_EQ(watched.pass(50, 1, 1), 0);
  EXPECT_EQ(watched.pass(30, 1, 1), 1);
  EXPECT_EQ(watched.name(), "rich");
}

TEST(StreamChoice, ANamedStreamThatCouldNotBeJoinedIsTriedAgain) {
  Watched watched("thin");
  watched.chooser.prefer(read_preference("rich"));
  ASSERT_EQ(watched.pass(1, 1, 1), 1);
  watched.chooser.gave_up(watched.now_ns);
  EXPECT_EQ(watched.name(), "thin");
  EXPECT_EQ(watched.pass(50, 1, 1), 0);
  EXPECT_EQ(watched.pass(20, 1, 1), 1);
  EXPECT_EQ(watched.name(), "rich");
}

TEST(StreamChoice, ThresholdsInForceDecideWhichErrorIsSmallest) {
  auto offers = thin_and_rich();
  offers[0].threshold = 1000;
  Watched watched("error", 5.0, offers);
  ASSERT_EQ(watched.name(), "thin");
  auto grown = rate(0, 0.3);
  grown.threshold = 20000;
  watched.chooser.on_status(grown);
  EXPECT_EQ(watched.pass(40, 1, 1), 1);
  EXPECT_EQ(watched.name(), "rich");
}

TEST(StreamChoice, ALinkThatFlapsBringsFewChanges) {
  Watched watched("computing");
  int changes = 0;
  for (int minute = 0; minute < 60; ++minute) {
    watched.chooser.on_loss(watched.now_ns);
    watched.chooser.on_loss(watched.now_ns);
    changes += watched.pass(60, 1, 1);
  }
  EXPECT_LE(changes, 15) << "in an hour";
  EXPECT_GE(changes, 1);
}

TEST(StreamChoice, AJoinThatTakesLongTriesFewerBits) {
  Watched watched("computing");
  const auto joining = [&](int seconds) {
    for (int i = 0; i < seconds; ++i) {
      watched.now_ns += kSecond;
      if (watched.chooser.reconsider({.now_ns = watched.now_ns, .idle_since_ns = 1000 * kSecond}))
        return true;
    }
    return false;
  };
  EXPECT_FALSE(joining(9));
  EXPECT_TRUE(joining(2));
  EXPECT_EQ(watched.name(), "rich");
  EXPECT_FALSE(joining(50)) << "nothing has fewer";
}

TEST(StreamChoice, AChangeThatWasGivenUpIsNotTriedAgainAtOnce) {
  Watched watched;
  ASSERT_EQ(watched.pass(4, 2, 25), 1);
  watched.chooser.gave_up(watched.now_ns);
  EXPECT_EQ(watched.name(), "rich");
  EXPECT_EQ(watched.pass(50, 2, 25), 0);
  EXPECT_GE(watched.pass(20, 2, 25), 1);
}

transport::SessionMessage two_streams(const std::string& second) {
  transport::SessionMessage session;
  session.capacity = 10'000;
  session.streams.resize(2);
  session.streams[0].layout.predictor = "ballistic";
  session.streams[1].id.id = session.streams[1].carries = 1;
  session.streams[1].name = second;
  session.streams[1].client_cost_ns = 70;
  session.streams[1].layout.predictor = "field";
  return session;
}

TEST(StreamChoice, AStreamIsCalledAsTheSessionSays) {
  const auto offers = list_offers(two_streams("rich"), {1}, 0);
  ASSERT_EQ(offers.size(), 1U);
  EXPECT_EQ(offers[0].name, "rich");
  EXPECT_EQ(offers[0].index, 1U);
  EXPECT_EQ(offers[0].announced_ns, 700'000);
  EXPECT_FALSE(offers[0].is_ballistic);
}

/// Two streams, the first of which is offered in two delays.
transport::SessionMessage three_offers() {
  transport::SessionMessage session = two_streams("rich");
  session.streams[0].name = "thin";
  session.streams[0].layout_hash = 5;
  session.streams[1].layout_hash = 6;
  session.streams.push_back(session.streams[0]);
  session.streams[2].id.id = 2;
  session.streams[2].delay_ms = 200;
  return session;
}

std::uint32_t chosen(const transport::SessionMessage& session, std::uint32_t max_delay_ms,
                     StreamPreference preference = {}) {
  std::vector<std::size_t> all(session.streams.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  return StreamChooser(list_offers(session, all, max_delay_ms), std::move(preference), 1e9 / 30, {})
      .chosen()
      .id.id;
}

TEST(StreamChoice, OfAStreamsOffersTheGreatestDelayIsPlayedThatIsNotAboveTheWantedOne) {
  transport::SessionMessage session = three_offers();
  const StreamPreference thin = read_preference("computing");
  EXPECT_EQ(chosen(session, 0, thin), 0U);
  EXPECT_EQ(chosen(session, 199, thin), 0U);
  EXPECT_EQ(chosen(session, 200, thin), 2U);
  EXPECT_EQ(chosen(session, 1000, thin), 2U);
  session.streams[0].delay_ms = 100;
  EXPECT_EQ(chosen(session, 50, thin), 0U) << "all are above: the shortest";
  session.streams[2].layout_hash = 7;
  session.streams[2].client_cost_ns = 0;
  session.streams[2].carries = 2;
  session.streams[0].client_cost_ns = 70;
  EXPECT_EQ(chosen(session, 100, thin), 2U) << "they differ in more";
}

TEST(StreamChoice, AnObserverWantsADelayAndAParticipantNone) {
  CoreOptions options;
  options.role = transport::Role::kObserver;
  EXPECT_EQ(options.delay_ms(), 200U);
  options.role = transport::Role::kParticipant;
  EXPECT_EQ(options.delay_ms(), 0U);
  options.max_delay_ms = 70;
  EXPECT_EQ(options.delay_ms(), 70U);
}

TEST(StreamChoice, ANameMeansAStreamAndANumberOneOfItsOffers) {
  transport::SessionMessage session = three_offers();
  EXPECT_EQ(chosen(session, 0, read_preference("thin")), 0U);
  EXPECT_EQ(chosen(session, 200, read_preference("thin")), 2U);
  EXPECT_EQ(chosen(session, 200, read_preference("0")), 0U);
  EXPECT_EQ(chosen(session, 0, read_preference("2")), 2U);
  EXPECT_EQ(chosen(session, 200, read_preference("rich")), 1U);
  for (auto& stream : session.streams) stream.name.clear();
  EXPECT_EQ(chosen(session, 200, read_preference("0")), 2U) << "the name of a stream without one";
  EXPECT_EQ(chosen(session, 0, read_preference("2")), 2U);
}

TEST(StreamChoice, AnotherDelayIsNoOtherStream) {
  transport::SessionMessage session = three_offers();
  session.streams.erase(session.streams.begin() + 1);
  StreamChooser chooser(list_offers(session, {0, 1}, 0), {}, 1e9 / 30, {});
  EXPECT_EQ(chooser.reason(), "the only one");
  EXPECT_FALSE(chooser.wants_status());
  std::int64_t now_ns = kSecond;
  for (int i = 0; i < 60; ++i) {
    now_ns += kSecond;
    for (int frame = 0; frame < 30; ++frame) chooser.on_frame(60 * kMillisecond);  // too slow
    chooser.on_loss(now_ns);
    EXPECT_FALSE(chooser.reconsider({.now_ns = now_ns}));
  }
}

TEST(StreamChoice, AClientStaysTwoSecondsWhereItChanged) {
  auto offers = thin_and_rich();
  offers.push_back(offers[1]);
  offers[2].id.id = 2;
  offers[2].name = "third";
  Watched watched("computing", std::nullopt, std::move(offers));
  EXPECT_EQ(watched.pass(1, 200, 200), 1) << "a frame takes six periods";
  EXPECT_EQ(watched.pass(1, 200, 200), 0);
  EXPECT_EQ(watched.pass(1, 200, 200), 1);
  watched.chooser.prefer(read_preference("thin"));
  EXPECT_EQ(watched.pass(1, 200, 200), 1) << "an application may at any time";
}

TEST(StreamChoice, StreamsWithoutANameHaveTheirNumber) {
  const auto offers = list_offers(two_streams(""), {0, 1}, 0);
  ASSERT_EQ(offers.size(), 2U);
  EXPECT_EQ(offers[0].name, "0");
  EXPECT_EQ(offers[1].name, "1");
}

}  // namespace
}  // namespace tandem::client::of_stream_choice
