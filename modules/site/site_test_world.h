#pragma once

// Sites for tests, of the walks in logs/two_walks.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "core/anchor.h"
#include "core/keyframe.h"
#include "site/compact.h"
#include "site/journal_writer.h"
#include "site/site.h"

namespace pangea::site {

// An empty folder for one test.
std::filesystem::path FreshFolder(const std::string& name);

struct StoredEvent {
  int64_t utime = 0;
  std::string channel;
  std::vector<uint8_t> data;

  bool operator==(const StoredEvent&) const = default;
};
// What a journal would have of the two walks, of these agents: keyframes, matches and verification
// results whose keyframes are theirs.
std::vector<StoredEvent> WalksOf(const std::set<int32_t>& agents);
// The first walk, then the second four times, a day apart, with what was said of each.
std::vector<StoredEvent> WalksAgainAndAgain();
// A thinning an hour after these.
ThinJournal AfterTheLast(const std::vector<StoredEvent>& events);
StoredEvent EditEvent(const AnchorId& anchor, int64_t revision, int64_t seq, bool deleted = false);
// Makes it, beside that keyframe; `p_body_anchor`: metres.
StoredEvent PlacementEvent(const AnchorId& anchor, int64_t seq, const KeyframeId& keyframe,
                           const Eigen::Vector3d& p_body_anchor);
StoredEvent OptionsEvent(const std::string& process, const std::string& yaml);

Site MakeSite(const std::filesystem::path& folder, const std::vector<StoredEvent>& events);
// Without CHECKSUMS and DAMAGED.
std::vector<StoredEvent> EventsOf(const Site& site);
// Why it threw.
std::string WhyNot(const std::function<void()>& action);
// In a process of its own, for which no file can be longer than so many bytes, as on a full disk;
// why it threw, empty if it did not.
std::string OnFullDisk(int64_t bytes, const std::function<void()>& action);
// What the agent_handler that opens it finds amiss; empty: nothing.
std::string FoundAtOpening(const Site& site);

}  // namespace pangea::site
