#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

#include "services/tandemd/metrics.hpp"

namespace tandem::daemon {
namespace {

SessionFacts two_streams() {
  SessionFacts facts;
  facts.session = "arena";
  facts.scene = "half_pipe";
  facts.frame_rate_hz = 30;
  facts.streams = {"thin", "rich"};
  facts.delays = {"0", "0"};
  facts.codecs = {"tracker", "tracker"};
  facts.predictors = {"ballistic", "field"};
  return facts;
}

FiguresNow figures_of(const SessionFacts& facts) {
  FiguresNow figures;
  figures.totals.streams.resize(facts.streams.size());
  figures.moment.streams.resize(facts.streams.size());
  figures.predict_took.resize(facts.streams.size());
  figures.encode_took.resize(facts.streams.size());
  return figures;
}

double value_of(const metrics::Page& page, const std::string& name, const std::string& label = {}) {
  for (const metrics::Family& family : page.families()) {
    for (const metrics::Sample& sample : family.samples) {
      const bool fits = label.empty() || (!sample.labels.empty() && sample.labels.back().value == label);
      if (family.name == name && fits) return sample.value;
    }
  }
  ADD_FAILURE() << name << " " << label << " is not there";
  return -1;
}

TEST(ServerPage, HasNoFiguresUntilTheHostHasBeenSeen) {
  metrics::Page page;
  describe(page, two_streams(), {});
  EXPECT_EQ(value_of(page, "tandem_server_state", "claiming"), 1);
  EXPECT_EQ(page.families().size(), 2U) << "the session and the state";
}

TEST(ServerPage, OfAServerThatStandsByTellsWhatItHolds) {
  FiguresNow figures;
  figures.standby = {.holds = 60, .behind = 7, .received_bytes = 1000};
  figures.checkpoint_age_s = 0.5;
  metrics::Page page;
  describe(page, two_streams(), figures);
  EXPECT_EQ(value_of(page, "tandem_server_state", "standing_by"), 1);
  EXPECT_EQ(value_of(page, "tandem_server_state", "claiming"), 0);
  EXPECT_EQ(value_of(page, "tandem_standby_checkpoint_frame"), 60);
  EXPECT_EQ(value_of(page, "tandem_standby_behind_frames"), 7);
  EXPECT_EQ(value_of(page, "tandem_standby_received_bytes_total"), 1000);
  EXPECT_EQ(value_of(page, "tandem_checkpoint_age_seconds"), 0.5);
}

TEST(ServerPage, TellsHowAnEngineInAnotherProcessDoes) {
  FiguresNow figures;
  figures.engine.emplace();
  figures.engine->name = "lammps";
  figures.engine->restarts = 3;
  figures.engine->state = EngineNow::State::kStopped;
  metrics::Page page;
  describe(page, two_streams(), figures);
  EXPECT_EQ(value_of(page, "tandem_engine_state", "stopped"), 1);
  EXPECT_EQ(value_of(page, "tandem_engine_state", "serves"), 0);
  EXPECT_EQ(value_of(page, "tandem_engine_restarts_total"), 3);
  EXPECT_EQ(value_of(page, "tandem_engine_info", "lammps"), 1);
}

TEST(ServerPage, NamesEachStateOfTheHost) {
  using State = host::Host::State;
  const SessionFacts facts = two_streams();
  FiguresNow figures = figures_of(facts);
  const std::map<State, std::string> names{{State::kClaiming, "claiming"},      {State::kWaiting, "waiting"},
                                           {State::kRunning, "running"},        {State::kRefused, "refused"},
                                           {State::kHandedOver, "handed_over"}, {State::kEnded, "ended"}};
  for (const auto& [state, name] : names) {
    figures.state = state;
    metrics::Page page;
    describe(page, facts, figures);
    EXPECT_EQ(value_of(page, "tandem_server_state", name), 1) << name;
  }
}

TEST(ServerPage, TellsStreamsAndReasonsApart) {
  const SessionFacts facts = two_streams();
  FiguresNow figures = figures_of(facts);
  figures.totals.streams[1].payload_bytes = 7;
  figures.totals.streams[1].observers = 2;
  figures.totals.inputs_refused.add(transport::Reason::kDemoted);
  figures.totals.messages_refused.add(transport::Reason::kFull);
  figures.totals.refused_messages = 3;
  figures.totals.suspended_ms = 1500;
  figures.moment.streams[0].threshold_m = 0.1;
  figures.state = host::Host::State::kRunning;
  metrics::Page page;
  describe(page, facts, figures);
  EXPECT_EQ(value_of(page, "tandem_payload_bytes_total", "thin"), 0);
  EXPECT_EQ(value_of(page, "tandem_payload_bytes_total", "rich"), 7);
  EXPECT_EQ(value_of(page, "tandem_threshold_meters", "thin"), 0.1);
  EXPECT_EQ(value_of(page, "tandem_refused_inputs_total", "demoted"), 1);
  EXPECT_EQ(value_of(page, "tandem_refused_messages_total", "full"), 1);
  EXPECT_EQ(value_of(page, "tandem_refused_messages_total", "unreadable"), 2);
  EXPECT_EQ(value_of(page, "tandem_suspended_seconds_total"), 1.5);
  EXPECT_EQ(value_of(page, "tandem_server_state", "running"), 1);
  EXPECT_EQ(value_of(page, "tandem_server_state", "waiting"), 0);
}

TEST(ServerPage, NamesFollowTheConventionsAndNoSeriesIsThereTwice) {
  const SessionFacts facts = two_streams();
  metrics::Page page;
  describe(page, facts, figures_of(facts));
  std::set<std::string> names;
  for (const metrics::Family& family : page.families()) {
    EXPECT_TRUE(names.insert(family.name).second) << family.name;
    EXPECT_TRUE(family.name.starts_with("tandem_")) << family.name;
    EXPECT_EQ(family.name.ends_with("_total"), family.kind == metrics::Kind::kCount) << family.name;
    if (family.kind == metrics::Kind::kDurations) {
      EXPECT_TRUE(family.name.ends_with("_duration_seconds")) << family.name;
    }
    EXPECT_FALSE(family.help.empty()) << family.name;
    std::set<std::string> labels;
    for (const metrics::Sample& sample : family.samples) {
      std::string all;
      for (const metrics::Label& label : sample.labels) all += label.value + "/";
      EXPECT_TRUE(labels.insert(all).second) << family.name << " " << all;
    }
  }
}

}  // namespace
}  // namespace tandem::daemon
