#include "site/merge.h"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <set>
#include <stdexcept>

#include "files/text_file.h"
#include "log_file/checksums.h"
#include "log_file/log_reader.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "site/journal_contents.h"
#include "site/journal_writer.h"
#include "site/site_files.h"

namespace pangea::site {
namespace {

namespace fs = std::filesystem;

// By seq: checksum of the keyframe's data.
using MapKeyframes = std::map<int32_t, uint32_t>;
using MapsOfJournal = std::map<MapId, MapKeyframes>;

bool IsKeyframe(const LogEvent& event) {
  return event.channel.starts_with(channels::kKeyframePrefix);
}

std::optional<KeyframeId> KeyframeOf(const LogEvent& event) {
  KeyframeMessage message{};
  return DecodeMessage(event.data, &message) ? Parse(message.id).value : std::nullopt;
}

std::optional<Constraint> ConstraintOf(const LogEvent& event) {
  constraint_t message{};
  return DecodeMessage(event.data, &message) ? Parse(message).value : std::nullopt;
}

void ReadJournal(const Site& site, const std::function<void(const LogEvent&)>& handler,
                 LogReadings* readings) {
  if (fs::exists(site.journal())) {
    ReadLog(site.journal(), handler, readings);
  }
}

MapsOfJournal ReadMaps(const Site& site, LogReadings* readings) {
  MapsOfJournal maps;
  ReadJournal(
      site,
      [&maps](const LogEvent& event) {
        const auto id = IsKeyframe(event) ? KeyframeOf(event) : std::nullopt;
        if (id) {
          maps[id->map].emplace(id->seq, EventChecksum(event.data));
        }
      },
      readings);
  return maps;
}

// The maps in both sites. Throws if one of them differs.
std::set<MapId> MapsInBoth(const Site& first, const MapsOfJournal& maps_first, const Site& second,
                           const MapsOfJournal& maps_second) {
  std::set<MapId> both;
  for (const auto& [id, keyframes] : maps_second) {
    const auto other = maps_first.find(id);
    if (other == maps_first.end()) {
      continue;
    }
    if (other->second != keyframes) {
      throw std::runtime_error(fmt::format(
          "map {} is in {} ({} keyframes) and in {} ({} keyframes), and is not the same in both; "
          "is one an older copy of the other? Then take the newer one alone",
          ToString(id), first.journal().string(), other->second.size(), second.journal().string(),
          keyframes.size()));
    }
    both.insert(id);
  }
  return both;
}

class Merger {
 public:
  Merger(const fs::path& journal, std::set<MapId> in_both)
      : writer_(journal), in_both_(std::move(in_both)) {}

  void TakeFirst(const LogEvent& event) {
    const std::string name = NameOf(event);
    if (event.channel == channels::kAnchorEdit) {
      WriteEdit(event, name);
    } else if (name.empty() || event.channel.starts_with(channels::kOptionsPrefix) ||
               names_.insert(name).second) {
      Write(event, &summary_.keyframes_first);
    }
  }

  void TakeSecond(const LogEvent& event) {
    const std::string name = NameOf(event);
    if (event.channel == channels::kAnchorEdit) {
      WriteEdit(event, name);
    } else if (GoesAlong(event) && names_.insert(name).second) {
      Write(event, &summary_.keyframes_second);
    }
  }

  MergeSummary Finish() {
    writer_.Finish();
    summary_.maps_in_both = std::ssize(in_both_);
    return summary_;
  }

 private:
  bool GoesAlong(const LogEvent& event) const {
    if (IsKeyframe(event)) {
      const auto id = KeyframeOf(event);
      return id && !in_both_.contains(id->map);
    }
    const auto constraint =
        event.channel == channels::kConstraint ? ConstraintOf(event) : std::nullopt;
    return constraint &&
           (constraint->from.map != constraint->to.map || constraint->kind == PlaceKind::kDerived);
  }

  // Capture times must not decrease, so those of the second site are at least the latest of the
  // first.
  void Write(const LogEvent& event, int64_t* keyframes) {
    latest_utime_ = std::max(latest_utime_, event.utime);
    writer_.Write(latest_utime_, event.channel, event.data);
    *keyframes += IsKeyframe(event) ? 1 : 0;
  }

  void WriteEdit(const LogEvent& event, const std::string& name) {
    anchor_edit_t message{};
    if (name.empty() || !DecodeMessage(event.data, &message) || !names_.insert(name).second) {
      return;
    }
    message.seq = summary_.anchor_edits++;
    latest_utime_ = std::max(latest_utime_, event.utime);
    writer_.Write(latest_utime_, event.channel, EncodeMessage(message));
  }

  JournalWriter writer_;
  const std::set<MapId> in_both_;
  std::set<std::string> names_;  // names of written events
  int64_t latest_utime_ = 0;
  MergeSummary summary_;
};

// Copies the site's keys, unless they are there already.
void CopyKeys(const Site& site, const fs::path& keys) {
  for (const fs::path& key : KeyFiles(site)) {
    const fs::path to = keys / key.filename();
    if (!fs::exists(to)) {
      fs::copy_file(key, to);
    } else if (ReadTextFile(to) != ReadTextFile(key)) {
      throw std::runtime_error(
          fmt::format("{}: is another key than the other site's; an agent has one: merge without "
                      "--with-keys, and make new keys",
                      key.string()));
    }
  }
}

void CopyOptions(const Site& site, const fs::path& options) {
  for (const fs::path& file : OptionFiles(site)) {
    fs::copy_file(file, options / file.filename());
  }
}

// Copies the agents that joined either site by invite; of two with the same id the first.
void CopyAgents(const std::vector<Site>& sites, const fs::path& agents) {
  for (const Site& site : sites) {
    for (const fs::path& file : GatewayAgentFiles(site)) {
      fs::create_directories(agents);
      fs::copy_file(file, agents / file.filename(), fs::copy_options::skip_existing);
    }
  }
}

}  // namespace

MergeSummary MergeSites(const Site& first, const Site& second, const fs::path& out,
                        const MergeOptions& options) {
  if (fs::equivalent(first.folder, second.folder)) {
    throw std::runtime_error(fmt::format("{} and {} are one site: give two", first.folder.string(),
                                         second.folder.string()));
  }
  SiteInTheMaking made(out);
  LogReadings readings;
  const MapsOfJournal maps = ReadMaps(first, &readings);
  std::set<MapId> in_both = MapsInBoth(first, maps, second, ReadMaps(second, &readings));
  const Site made_site{made.folder(), {}};
  Merger merger(made_site.journal(), std::move(in_both));
  ReadJournal(
      first, [&merger](const LogEvent& event) { merger.TakeFirst(event); }, &readings);
  ReadJournal(
      second, [&merger](const LogEvent& event) { merger.TakeSecond(event); }, &readings);
  MergeSummary summary = merger.Finish();
  for (const auto& [log, reading] : readings) {
    summary.bytes_lost += reading.lost_bytes;
  }
  fs::create_directories(made_site.keys());
  fs::permissions(made_site.keys(), fs::perms::owner_all);
  fs::create_directories(made_site.options());
  CopyOptions(first, made_site.options());
  if (fs::exists(first.tags())) {
    fs::copy_file(first.tags(), made_site.tags());
  }
  CopyAgents({first, second}, made_site.gateway() / "agents");
  if (options.with_keys) {
    CopyKeys(first, made_site.keys());
    CopyKeys(second, made_site.keys());
  }
  SiteDescription description =
      NewDescription(options.name.empty() ? NameOfFolder(out) : options.name);
  description.bus = first.description.bus;
  description.link = first.description.link;
  made.Commit(description);
  return summary;
}

}  // namespace pangea::site
