#include "site/site_test_world.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <stdexcept>

#include "files/testing/full_disk.h"
#include "log_file/log_reader.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/options_t.hpp"

namespace pangea::site {
namespace {

namespace fs = std::filesystem;

template <typename Message>
auto ParseEvent(const LogEvent& event) {
  Message message{};
  EXPECT_TRUE(DecodeMessage(event.data, &message));
  return Parse(message).value.value();
}

bool IsOf(const LogEvent& event, const std::set<int32_t>& agents) {
  const auto has = [&agents](const KeyframeId& id) { return agents.contains(id.map.agent_id); };
  if (event.channel == channels::kPlaceMatch) {
    const auto match = ParseEvent<place_match_t>(event);
    return has(match.query) &&
           std::ranges::all_of(match.candidates, [&](const auto& c) { return has(c.match); });
  }
  if (event.channel == channels::kConstraint) {
    const auto constraint = ParseEvent<constraint_t>(event);
    return has(constraint.from) && has(constraint.to);
  }
  return agents.contains(channels::AgentOf(event.channel, channels::kKeyframePrefix));
}

constexpr int64_t kDay_us = int64_t{24} * 3600 * 1'000'000;

// Makes an event of another visit from one of the second walk.
template <typename Message, typename Rename>
StoredEvent Renamed(const StoredEvent& event, const Rename& rename) {
  Message message{};
  DecodeMessage(event.data, &message);
  auto value = *Parse(message).value;
  rename(&value);
  return {event.utime, event.channel, EncodeMessage(ToMessage(value))};
}

// Empty if the event does not concern the second walk.
std::optional<StoredEvent> OfVisit(const StoredEvent& event, int visit) {
  bool says_something = false;
  const auto rename = [&](KeyframeId* id) {
    if (id->map.agent_id == 2) {
      id->map.opened_utime += visit;
      says_something = true;
    }
  };
  StoredEvent again;
  if (event.channel == channels::kPlaceMatch) {
    again = Renamed<place_match_t>(event, [&](PlaceMatch* match) {
      rename(&match->query);
      for (PlaceCandidate& candidate : match->candidates) {
        rename(&candidate.match);
      }
    });
  } else if (event.channel == channels::kConstraint) {
    again = Renamed<constraint_t>(event, [&](Constraint* constraint) {
      rename(&constraint->from);
      rename(&constraint->to);
    });
  } else {
    again = Renamed<KeyframeMessage>(event, [&](Keyframe* keyframe) { rename(&keyframe->id); });
  }
  again.utime += visit * kDay_us;
  return says_something ? std::optional(again) : std::nullopt;
}

AnchorEdit Kettle(const AnchorId& anchor, int64_t seq) {
  AnchorEdit edit;
  edit.anchor = anchor;
  edit.agent_id = anchor.agent_id;
  edit.right = AnchorRight::kEditOwn;
  edit.seq = seq;
  edit.name = "kettle";
  return edit;
}

StoredEvent EventOf(const AnchorEdit& edit) {
  return {1'800'000'000'000'000, std::string(channels::kAnchorEdit),
          EncodeMessage(ToMessage(edit))};
}

}  // namespace

fs::path FreshFolder(const std::string& name) {
  fs::path folder =
      fs::path(testing::TempDir()) / ("pangea_site_" + name + "_" + std::to_string(getpid()));
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

std::vector<StoredEvent> WalksOf(const std::set<int32_t>& agents) {
  std::vector<StoredEvent> events;
  const std::string log = PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm";
  ReadLog(log, [&](const LogEvent& event) {
    if (IsOf(event, agents)) {
      events.push_back({event.utime, event.channel, {event.data.begin(), event.data.end()}});
    }
  });
  EXPECT_FALSE(events.empty());
  return events;
}

std::vector<StoredEvent> WalksAgainAndAgain() {
  const std::vector<StoredEvent> walks = WalksOf({1, 2});
  std::vector<StoredEvent> events = walks;
  constexpr int kVisits = 4;
  for (int visit = 1; visit < kVisits; ++visit) {
    for (const StoredEvent& event : walks) {
      if (const auto again = OfVisit(event, visit)) {
        events.push_back(*again);
      }
    }
  }
  return events;
}

ThinJournal AfterTheLast(const std::vector<StoredEvent>& events) {
  return {{}, events.back().utime + kDay_us / 24};
}

StoredEvent EditEvent(const AnchorId& anchor, int64_t revision, int64_t seq, bool deleted) {
  AnchorEdit edit = Kettle(anchor, seq);
  edit.revision = revision;
  edit.deleted = deleted;
  return EventOf(edit);
}

StoredEvent PlacementEvent(const AnchorId& anchor, int64_t seq, const KeyframeId& keyframe,
                           const Eigen::Vector3d& p_body_anchor) {
  AnchorEdit edit = Kettle(anchor, seq);
  edit.placement = AnchorEdit::Placement::kKeyframe;
  edit.map = keyframe.map;
  edit.keyframe_seq = keyframe.seq;
  edit.T_ref_anchor.t = p_body_anchor;
  return EventOf(edit);
}

StoredEvent OptionsEvent(const std::string& process, const std::string& yaml) {
  options_t message{};
  message.process = process;
  message.utime = 1;
  message.yaml = yaml;
  return {1'800'000'000'000'000, channels::Options(process), EncodeMessage(message)};
}

Site MakeSite(const fs::path& folder, const std::vector<StoredEvent>& events) {
  Site site = CreateSite(folder, NewDescription(folder.filename()));
  JournalWriter writer(site.journal());
  int since_sync = 0;
  for (const StoredEvent& event : events) {
    writer.Write(event.utime, event.channel, event.data);
    if (++since_sync % 10 == 0) {  // groups as small as those of a server
      writer.Finish();
    }
  }
  writer.Finish();
  return site;
}

std::vector<StoredEvent> EventsOf(const Site& site) {
  std::vector<StoredEvent> events;
  ReadLog(site.journal(), [&](const LogEvent& event) {
    events.push_back({event.utime, event.channel, {event.data.begin(), event.data.end()}});
  });
  return events;
}

std::string WhyNot(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "nothing was refused";
}

std::string OnFullDisk(int64_t bytes, const std::function<void()>& action) {
  int said[2];
  EXPECT_EQ(pipe(said), 0);
  const pid_t child = fork();
  if (child == 0) {
    const FullDisk full(static_cast<uint64_t>(bytes));
    try {
      action();
    } catch (const std::exception& error) {
      [[maybe_unused]] const auto n = write(said[1], error.what(), std::strlen(error.what()));
    }
    _exit(0);
  }
  close(said[1]);
  char text[1000] = {};
  [[maybe_unused]] const auto n = read(said[0], text, sizeof(text) - 1);
  close(said[0]);
  waitpid(child, nullptr, 0);
  return text;
}

std::string FoundAtOpening(const Site& site) {
  const Journal journal(site.journal(),
                        [](const std::string&, Bytes, const JournalPlace&) { return true; });
  return journal.mend().Said(site.journal());
}

}  // namespace pangea::site
