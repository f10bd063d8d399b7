// Tests that a server process which restores a checkpoint and reads the rest of the journal
// publishes the same bytes as one that reads the whole journal, then and later.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bus/status_log.h"
#include "checkpoint/checkpoint_file.h"
#include "fusion/fusion_process.h"
#include "global_ba/global_ba_process.h"
#include "inter_map_ba/inter_map_ba_process.h"
#include "journal_follower/journal_reader.h"
#include "log_file/log_reader.h"
#include "log_file/log_writer.h"
#include "map_points/map_points_process.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "place_recognition/place_recognition_process.h"
#include "posegraph/posegraph_process.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

struct Event {
  std::string channel;
  std::vector<uint8_t> data;
  bool operator==(const Event&) const = default;
};
using Events = std::vector<Event>;

// Whether the event is in the journal; the processes read other channels, too.
bool IsJournalled(const std::string& channel) {
  return channel.starts_with(channels::kKeyframePrefix) || channel == channels::kPlaceMatch ||
         channel == channels::kConstraint;
}

Events RecordedEvents() {
  Events events;
  ReadLog(
      PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm",
      [&events](const LogEvent& event) {
        if (IsJournalled(event.channel) || event.channel == channels::kMapState ||
            event.channel.starts_with("POSE_")) {
          events.push_back({event.channel, {event.data.begin(), event.data.end()}});
        }
      },
      nullptr, WhileReading::kTellNothing);
  return events;
}

// "CONSTRAINT 12": channel and index of the first message that differs; empty if none does.
std::string Difference(const Events& a, const Events& b) {
  for (size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    if (i >= a.size() || i >= b.size() || a[i] != b[i]) {
      return (i < a.size() ? a[i] : b[i]).channel + " " + std::to_string(i);
    }
  }
  return "";
}

// The last MAP_STATE, with revision 1 as if it were the first.
Event NewestState(const Events& events) {
  map_state_t state{};
  for (const Event& event : events) {
    if (event.channel == channels::kMapState) {
      EXPECT_TRUE(DecodeMessage(event.data, &state));
    }
  }
  EXPECT_EQ(state.num_maps, 2);
  state.revision = 1;
  return {std::string(channels::kMapState), EncodeMessage(state)};
}

using MakeProcess = std::unique_ptr<Process> (*)(Bus&, const CheckpointPlace&);

template <typename ProcessType, typename Options>
std::unique_ptr<Process> Make(Bus& bus, const CheckpointPlace& checkpoint) {
  return std::make_unique<ProcessType>(bus, Options{}, nullptr, checkpoint);
}

std::unique_ptr<Process> MakeMapPoints(Bus& bus, const CheckpointPlace& checkpoint) {
  return std::make_unique<MapPointsProcess>(bus, nullptr, checkpoint);
}

std::unique_ptr<Process> MakePoseGraph(Bus& bus, const CheckpointPlace& checkpoint) {
  return std::make_unique<PoseGraphProcess>(bus, PoseGraphOptions{}, std::nullopt, checkpoint);
}

struct Named {
  std::string name;
  MakeProcess make;
  std::string says;  // channel on which its results end
};

void PrintTo(const Named& named, std::ostream* out) { *out << named.name; }

class RestartCheckpoint : public testing::TestWithParam<Named> {
 protected:
  RestartCheckpoint() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~RestartCheckpoint() override { fs::remove_all(folder_); }

  // The journal of the first `count` events.
  std::string Journal(size_t count) const {
    std::string path = folder_ / "journal.lcm";
    LogFileWriter writer(path);
    for (size_t i = 0; i < count; ++i) {
      if (IsJournalled(events_[i].channel)) {
        writer.Write(0, events_[i].channel, events_[i].data);
      }
    }
    return path;
  }
  void WriteCheckpoint(const std::string& journal, const std::string& options = "") const {
    LocalBus bus;
    const auto process = GetParam().make(bus, {checkpoint_, options, true});
    PublishMessage(bus, std::string(channels::kJournalFile),
                   ToMessage(JournalFile{journal, ReadJournalState(journal, {})}));
    bus.Drain();
  }
  // The messages of a process that starts on this journal and gets `num_live` further events.
  Events Said(const std::string& journal, size_t count, const CheckpointPlace& checkpoint,
              size_t num_live = 0) const {
    LocalBus bus;
    Events said;
    const auto process = GetParam().make(bus, checkpoint);
    bus.Subscribe(".*", [&said](const std::string& channel, Bytes data) {
      if (!channel.starts_with("STATUS_")) {
        said.push_back({channel, {data.begin(), data.end()}});
      }
    });
    int64_t now = 0;
    const auto tick = [&] {
      for (const int64_t end = now + 10'000'000; now < end;) {
        process->Tick(now += 100'000);
        bus.Drain();
      }
    };
    const JournalFile file{journal, ReadJournalState(journal, {})};
    PublishMessage(bus, std::string(channels::kJournalFile), ToMessage(file));
    bus.Drain();
    PublishMessage(bus, std::string(channels::kHave), Have(count));
    bus.Drain();
    tick();
    for (size_t i = count; i < count + num_live; ++i) {
      bus.Publish(events_[i].channel, events_[i].data);
      if (events_[i].channel == channels::kMapState && GetParam().name == "map_points") {
        bus.Publish(std::string(channels::kRefinement), events_[i].data);
      }
      bus.Drain();
    }
    tick();
    EXPECT_TRUE(num_live == 0 || std::ranges::any_of(said, [](const Event& event) {
                  return event.channel == GetParam().says;
                }));
    return said;
  }
  have_t Have(size_t count) const {
    std::map<MapId, int32_t> highest;
    for (size_t i = 0; i < count; ++i) {
      KeyframeMessage keyframe{};
      if (DecodeMessage(events_[i].data, &keyframe)) {
        highest[*Parse(keyframe.id.map).value] = keyframe.id.seq;
      }
    }
    have_t have{};
    for (const auto& [map, seq] : highest) {
      have.maps.push_back(ToMessage(map));
      have.highest_seq.push_back(seq);
    }
    have.num_maps = static_cast<int16_t>(highest.size());
    return have;
  }

  const Events events_ = RecordedEvents();
  const fs::path folder_ =
      fs::path(testing::TempDir()) / ("restart_checkpoint_" + std::to_string(getpid()));
  const fs::path checkpoint_ = folder_ / "checkpoint";
  const CheckpointPlace restored_{checkpoint_, "", false};
  const CheckpointPlace all_read_;
};

TEST_P(RestartCheckpoint, SaysTheSameOfTheSameJournal) {
  const size_t count = events_.size() / 2;
  const std::string journal = Journal(count);
  WriteCheckpoint(journal);
  ASSERT_TRUE(fs::exists(checkpoint_));
  const size_t num_live = events_.size() / 5;
  EXPECT_EQ(Difference(Said(journal, count, restored_, num_live),
                       Said(journal, count, all_read_, num_live)),
            "");
}

TEST_P(RestartCheckpoint, OneOfAnotherJournalOrOtherOptionsIsNotUsed) {
  const size_t count = events_.size() / 4;
  const Events full = Said(Journal(count), count, all_read_);
  // Some processes publish nothing about a journal alone, so the log is read too.
  const auto expect_not_used = [&](const char* why) {
    testing::internal::CaptureStderr();
    StartLog("test", "");
    EXPECT_EQ(Difference(Said(Journal(count), count, restored_), full), "");
    EXPECT_THAT(testing::internal::GetCapturedStderr(), testing::HasSubstr("is not used: ")) << why;
  };
  WriteCheckpoint(Journal(2 * count));
  expect_not_used("the journal was longer");
  WriteCheckpoint(Journal(count), "other");
  expect_not_used("other options");
  std::ofstream(checkpoint_) << "no checkpoint";
  expect_not_used("no checkpoint");
}

TEST_P(RestartCheckpoint, OneOfAnotherProcessOrVersionIsNotUsed) {
  const size_t count = events_.size() / 8;
  const std::string journal = Journal(count);
  WriteCheckpoint(journal);
  const CheckpointKey own = CheckpointReader(checkpoint_).head().key;
  EXPECT_EQ(own.process, GetParam().name);
  const auto why_not = [&](const std::string& process, uint32_t format) {
    CheckpointWriter(checkpoint_, {process, format, ""}, ReadJournalState(journal, {})).Commit();
    testing::internal::CaptureStderr();
    StartLog("test", "");
    Said(journal, count, restored_);
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_THAT(why_not("another", own.format), testing::HasSubstr("it is one of another"));
  EXPECT_THAT(why_not(own.process, own.format + 1), testing::HasSubstr("it is of another version"));
}

// The rest of the journal after the checkpoint is read as if all had been read. The pose graph
// starts with the restored solution; after it has solved all from the beginning, both agree.
TEST_P(RestartCheckpoint, ReadsTheRestOfTheJournal) {
  const size_t count = events_.size() / 2;
  WriteCheckpoint(Journal(count / 2));
  const std::string journal = Journal(count);
  const size_t num_live = events_.size() / 5;
  Events restored = Said(journal, count, restored_, num_live);
  Events all_read = Said(journal, count, all_read_, num_live);
  ASSERT_EQ(restored.empty(), all_read.empty());
  if (GetParam().name == "posegraph") {
    restored = {NewestState(restored)};
    all_read = {NewestState(all_read)};
  }
  EXPECT_EQ(Difference(restored, all_read), "");
}

INSTANTIATE_TEST_SUITE_P(
    Of, RestartCheckpoint,
    testing::Values(Named{"place_recognition",
                          Make<PlaceRecognitionProcess, PlaceRecognitionOptions>, "PLACE_MATCH"},
                    Named{"posegraph", MakePoseGraph, "MAP_STATE"},
                    Named{"fusion", Make<FusionProcess, LoopVerifierOptions>, "CONSTRAINT"},
                    Named{"inter_map_ba", Make<InterMapBaProcess, LoopVerifierOptions>,
                          "CONSTRAINT"},
                    Named{"global_ba", Make<GlobalBaProcess, GlobalBaOptions>, "REFINEMENT"},
                    Named{"map_points", MakeMapPoints, "LANDMARKS_1"}),
    [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace pangea
