#include "site/site_info.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

#include "anchors/anchor_registry.h"
#include "anchors/anchors.h"
#include "checkpoint/checkpoint_file.h"
#include "log_file/log_reader.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "site/site_delete.h"
#include "site/site_options.h"

namespace pangea::site {
namespace {

namespace fs = std::filesystem;

int64_t BytesIn(const fs::path& folder) {
  int64_t bytes = 0;
  std::error_code ignored;  // files that may not be read, or were just removed
  for (auto it = fs::recursive_directory_iterator(
           folder, fs::directory_options::skip_permission_denied, ignored);
       it != fs::recursive_directory_iterator(); it.increment(ignored)) {
    bytes += it->is_regular_file(ignored) ? static_cast<int64_t>(it->file_size(ignored)) : 0;
  }
  return bytes;
}

// Collects the counts of SiteInfo from the events.
class Counter {
 public:
  Counter(int max_anchors, SiteInfo* info)
      : info_(info), registry_(static_cast<size_t>(max_anchors)) {}

  void Take(const LogEvent& event) {
    info_->first_utime = std::min(info_->first_utime.value_or(event.utime), event.utime);
    info_->last_utime = std::max(info_->last_utime.value_or(event.utime), event.utime);
    if (event.channel.starts_with(channels::kKeyframePrefix)) {
      TakeKeyframe(event.data);
    } else if (event.channel == channels::kPlaceMatch) {
      ++info_->matches;
    } else if (event.channel == channels::kConstraint) {
      TakeConstraint(event.data);
    } else if (event.channel == channels::kAnchorEdit) {
      TakeEdit(event.data);
    }
  }
  int64_t anchors() const {
    return static_cast<int64_t>(registry_.entries().size() - registry_.num_deleted());
  }

 private:
  void TakeKeyframe(Bytes data) {
    KeyframeMessage message{};
    if (DecodeMessage(data, &message)) {
      if (const auto id = Parse(message.id).value) {
        info_->keyframes[id->map].insert(id->seq);
        if (message.has_edge && message.edge_from_seq < id->seq - 1) {
          info_->long_edges[*id] = message.edge_from_seq;
        }
      }
    }
  }
  void TakeConstraint(Bytes data) {
    constraint_t message{};
    if (DecodeMessage(data, &message)) {
      ++(message.accepted ? info_->constraints_accepted : info_->constraints_refused);
    }
  }
  void TakeEdit(Bytes data) {
    anchor_edit_t message{};
    if (DecodeMessage(data, &message)) {
      if (const auto edit = Parse(message).value) {
        registry_.Take(*edit);
      }
    }
  }

  SiteInfo* info_;
  AnchorRegistry registry_;
};

std::string Megabytes(int64_t bytes) {
  return fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(bytes));
}

std::string Date(std::optional<int64_t> utime) {
  return utime ? fmt::format("{:%Y-%m-%d %H:%M:%S} UTC",
                             fmt::gmtime(static_cast<std::time_t>(*utime / 1'000'000)))
               : "-";
}

bool IsDeleted(const fs::path& folder) {
  return folder.filename().string().find(kDeletedMark) != std::string::npos;
}

std::string UseOf(const std::optional<int>& user) {
  return user ? fmt::format("in use by process {}", *user) : "not in use";
}

std::string DamageOf(const SiteInfo& info) {
  const LogReading damage = info.damage();
  return damage.whole() ? "none" : DescribeLoss(damage);
}

std::string Missing(const SiteInfo& info, const MapId& map) {
  int64_t missing = 0;
  int32_t next = 0;
  for (const int32_t seq : info.keyframes.at(map)) {
    const auto edge = info.long_edges.find({map, seq});
    const bool leads_over = edge != info.long_edges.end() && edge->second == next - 1;
    missing += leads_over ? 0 : seq - next;
    next = seq + 1;
  }
  return missing == 0 ? "" : fmt::format(", {} missing", missing);
}

std::string Line(const std::string& what, const std::string& value) {
  return fmt::format("{:<12} {}\n", what, value);
}

std::map<std::string, std::string> ReadCheckpoints(const Site& site) {
  std::map<std::string, std::string> checkpoints;
  std::error_code error;
  const auto journal_bytes = static_cast<double>(fs::file_size(site.journal(), error));
  for (const auto& entry : fs::directory_iterator(site.checkpoints(), error)) {
    std::string& said = checkpoints[entry.path().filename()];
    try {
      const JournalState journal = CheckpointReader(entry.path()).head().journal;
      said = fmt::format("{:.0f} % of the journal",
                         100 * static_cast<double>(journal.num_bytes) / journal_bytes);
    } catch (const std::runtime_error& unusable) {
      said = fmt::format("not used, {}", unusable.what());
    }
  }
  return checkpoints;
}

}  // namespace

LogReading SiteInfo::damage() const {
  LogReading damage = reading;
  damage.torn_bytes = user ? 0 : damage.torn_bytes;
  return damage;
}

SiteInfo ReadInfo(const Site& site) {
  SiteInfo info;
  info.site = site;
  info.user = UserOf(site);
  info.bytes = BytesIn(site.folder);
  info.free_bytes = static_cast<int64_t>(fs::space(site.folder).available);
  if (fs::exists(site.journal())) {
    Counter counter(ReadOptions<AnchorsOptions>(site, "anchors").max_anchors, &info);
    LogReadings readings;
    ReadLog(
        site.journal(), [&counter](const LogEvent& event) { counter.Take(event); }, &readings);
    info.anchors = counter.anchors();
    info.reading = readings.at(site.journal());
    info.checkpoints = ReadCheckpoints(site);
  }
  return info;
}

std::string ToText(const SiteInfo& info) {
  const SiteDescription& description = info.site.description;
  std::map<int32_t, int> maps_of_agent;
  int64_t num_keyframes = 0;
  for (const auto& [map, seqs] : info.keyframes) {
    ++maps_of_agent[map.agent_id];
    num_keyframes += std::ssize(seqs);
  }
  std::vector<int32_t> agents;
  for (const auto& [agent, maps] : maps_of_agent) {
    agents.push_back(agent);
  }
  std::string text =
      Line("name", description.name) + Line("folder", info.site.folder.string()) +
      Line("created", description.created) + Line("state", UseOf(info.user)) +
      Line("size", Megabytes(info.bytes)) + Line("free disk", Megabytes(info.free_bytes)) +
      Line("bus", description.bus) + Line("link", description.link) +
      Line("agents", fmt::format("{}", fmt::join(agents, ", "))) +
      Line("maps", fmt::format("{}", info.keyframes.size())) +
      Line("keyframes", fmt::format("{}", num_keyframes)) +
      Line("matches", fmt::format("{}", info.matches)) +
      Line("constraints", fmt::format("{} accepted, {} refused", info.constraints_accepted,
                                      info.constraints_refused)) +
      Line("anchors", fmt::format("{}", info.anchors)) + Line("first", Date(info.first_utime)) +
      Line("last", Date(info.last_utime)) + Line("damage", DamageOf(info));
  for (const auto& [process, said] : info.checkpoints) {
    text += Line("checkpoint", fmt::format("{}: {}", process, said));
  }
  for (const auto& [map, seqs] : info.keyframes) {
    text += Line("map",
                 fmt::format("{}: {} keyframes{}", ToString(map), seqs.size(), Missing(info, map)));
  }
  return text;
}

std::vector<fs::path> DefaultSiteFolders() {
  std::vector<fs::path> folders;
  if (const char* home = std::getenv("HOME"); home != nullptr) {
    folders.push_back(fs::path(home) / ".local/share/pangea");
  }
  folders.emplace_back("/var/lib/pangea");
  std::error_code error;
  std::erase_if(folders, [&error](const fs::path& folder) {
    fs::directory_iterator(folder, error);
    return error && error != std::errc::permission_denied;
  });
  return folders;
}

std::string ListSites(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    throw std::runtime_error(fmt::format("{}: is no folder", folder.string()));
  }
  std::vector<fs::path> sites;
  std::string unreadable;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::error_code error;
    if (fs::exists(entry.path() / "site.yaml", error)) {
      sites.push_back(entry.path());
    } else if (error == std::errc::permission_denied) {
      unreadable +=
          fmt::format("{:<24} {:>12}  {}  {}\n", "?", "", entry.path().string(), error.message());
    }
  }
  std::ranges::sort(sites);
  std::string text;
  for (const fs::path& path : sites) {
    try {
      const Site site = ReadSite(path);
      const auto user = UserOf(site);
      text +=
          fmt::format("{:<24} {:>12}  {}  {}\n", site.description.name, Megabytes(BytesIn(path)),
                      path.string(), IsDeleted(path) && !user ? "deleted" : UseOf(user));
    } catch (const std::exception& error) {
      text += fmt::format("{:<24} {:>12}  {}  {}\n", "?", Megabytes(BytesIn(path)), path.string(),
                          error.what());
    }
  }
  return text + unreadable;
}

}  // namespace pangea::site
