#pragma once

// Sites for tests, made of the two walks in logs/two_walks.

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
// The journal's events of these agents' walks: their keyframes, and the matches and verification
// results with only their keyframes.
std::vector<StoredEvent> WalksOf(const std::set<int32_t>& agents);
// The first walk, then the second one four times, a day apart, each with its matches and results.
std::vector<StoredEvent> WalksAgainAndAgain();
// A thinning one hour after the last event.
ThinJournal AfterTheLast(const std::vector<StoredEvent>& events);
StoredEvent EditEvent(const AnchorId& anchor, int64_t revision, int64_t seq, bool deleted = false);
// Creates the anchor at `p_body_anchor` (metres) in the keyframe's body frame.
StoredEvent PlacementEvent(const AnchorId& anchor, int64_t seq, const KeyframeId& keyframe,
                           const Eigen::Vector3d& p_body_anchor);
StoredEvent OptionsEvent(const std::string& process, const std::string& yaml);

Site MakeSite(const std::filesystem::path& folder, const std::vector<StoredEvent>& events);
// Without CHECKSUMS and DAMAGED.
std::vector<StoredEvent> EventsOf(const Site& site);
// The message of the exception that `action` throws.
std::string WhyNot(const std::function<void()>& action);
// Runs `action` in a child process that can write no file longer than `bytes`, as on a full disk.
// Returns the message of its exception; empty if it throws none.
std::string OnFullDisk(int64_t bytes, const std::function<void()>& action);
// Errors that the agent_handler finds when it opens the site's journal; empty: none.
std::string FoundAtOpening(const Site& site);

}  // namespace pangea::site
