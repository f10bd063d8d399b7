#include "site/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "bus/process.h"
#include "files/whole_file.h"
#include "log_file/log_reading.h"
#include "options/command_line.h"
#include "site/backup.h"
#include "site/compact.h"
#include "site/merge.h"
#include "site/site.h"
#include "site/site_delete.h"
#include "site/site_export.h"
#include "site/site_info.h"
#include "site/site_options.h"
#include "tags/tag_file.h"
#include "tags/tag_sheet.h"

namespace pangea::site {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  bool* lost = nullptr;  // set after damage that the command itself told
  std::string site, other, out, name, bus, link;
  bool with_keys = false;
  bool now = false;
  bool thin = false;
};
using Shared = std::shared_ptr<Arguments>;

double Megabytes(int64_t bytes) { return 1e-6 * static_cast<double>(bytes); }

void NoteLoss(const fs::path& of, int64_t bytes, const Arguments& arguments) {
  if (bytes > 0) {
    *arguments.lost = true;
    std::cerr << fmt::format(
        "pangea-site: {}: {} bytes of it are damaged or incomplete, and lost; all else is there\n",
        of.string(), bytes);
  }
}

void NoteNoKeys(const Site& site) {
  if (fs::is_empty(site.keys())) {
    std::cout << fmt::format("no agent can join yet: {} has no keys\n", site.keys().string());
  }
}

void List(const std::string& folder) {
  const std::vector<fs::path> folders =
      folder.empty() ? DefaultSiteFolders() : std::vector<fs::path>{folder};
  std::exception_ptr unreadable;  // told after the sites of the other folders
  std::string text;
  for (const fs::path& one : folders) {
    try {
      text += ListSites(one);
    } catch (const std::exception&) {
      unreadable = std::current_exception();
    }
  }
  std::cout << (text.empty() && !unreadable
                    ? "no sites here; name their folder, or: pangea-site create PATH\n"
                    : text);
  if (unreadable) {
    std::rethrow_exception(unreadable);
  }
}

void Create(const Arguments& arguments) {
  const fs::path folder = arguments.site;
  SiteDescription description =
      NewDescription(arguments.name.empty() ? NameOfFolder(folder) : arguments.name);
  description.bus = arguments.bus.empty() ? description.bus : arguments.bus;
  description.link = arguments.link.empty() ? description.link : arguments.link;
  const Site site = CreateSite(folder, description);
  std::cout << fmt::format(
      "{}: made; a key for each agent into {}, then: pangea-server --site {}\n", folder.string(),
      site.keys().string(), InShell(folder));
}

void NoteSitesInside(const Site& site) {
  for (const fs::path& inside : SitesInside(site)) {
    std::cerr << fmt::format(
        "pangea-site: {}: is a site of its own, and not in this backup: back it up too\n",
        inside.string());
  }
}

void RunBackup(const Arguments& arguments) {
  const Site site = ReadSite(arguments.site);
  const BackupSummary summary = BackUp(site, arguments.out, arguments.with_keys);
  std::cout << fmt::format(
      "{}: {:.1f} MB of journal, {} events, in {:.1f} MB; read again: the "
      "same{}\n",
      arguments.out, Megabytes(summary.journal_bytes), summary.events, Megabytes(summary.bytes),
      arguments.with_keys ? "; it holds the agents' keys: keep it safe" : "");
  NoteSitesInside(site);
  NoteLoss(arguments.site, summary.lost_bytes, arguments);
}

void RunRestore(const Arguments& arguments) {
  const BackupSummary summary = Restore(arguments.other, arguments.site);
  std::cout << fmt::format("{}: {:.1f} MB of journal, {} events\n", arguments.site,
                           Megabytes(summary.journal_bytes), summary.events);
  NoteNoKeys(ReadSite(arguments.site));
  NoteLoss(arguments.site, summary.lost_bytes, arguments);
}

void RunMerge(const Arguments& arguments) {
  const MergeSummary summary = MergeSites(ReadSite(arguments.site), ReadSite(arguments.other),
                                          arguments.out, {arguments.name, arguments.with_keys});
  std::cout << fmt::format(
      "{}: {} keyframes of {}, {} of {}, {} anchor edits; {} maps were in both\n", arguments.out,
      summary.keyframes_first, arguments.site, summary.keyframes_second, arguments.other,
      summary.anchor_edits, summary.maps_in_both);
  std::cout << "the server that starts on it looks for places that both have\n";
  NoteNoKeys(ReadSite(arguments.out));
  NoteLoss(arguments.out, summary.bytes_lost, arguments);
}

void RunInfo(const Arguments& arguments) {
  const SiteInfo info = ReadInfo(ReadSite(arguments.site));
  std::cout << ToText(info);
  *arguments.lost = !info.damage().whole();
}

void RunCompact(const Arguments& arguments) {
  const Site site = ReadSite(arguments.site);
  std::optional<ThinJournal> thin;
  if (arguments.thin) {
    thin = {ReadOptions<ThinningOptions>(site, "thinning"), WallUtime()};
  }
  const CompactSummary summary = Compact(site, thin);
  *arguments.lost = summary.damaged;
  if (thin) {
    std::cout << fmt::format(
        "{}: {} keyframes go, of places that newer ones show; {} constraints take the place of "
        "theirs\n",
        site.journal().string(), summary.keyframes_gone, summary.constraints_derived);
  }
  std::cout << fmt::format("{}: {} events in {:.1f} MB, before {} in {:.1f} MB\n",
                           site.journal().string(), summary.events_after,
                           Megabytes(summary.bytes_after), summary.events_before,
                           Megabytes(summary.bytes_before));
}

void RunDelete(const Arguments& arguments) {
  const Site site = ReadSite(arguments.site);
  std::cout << fmt::format("{}: type the site's name, {}, to {}: ", site.folder.string(),
                           site.description.name, arguments.now ? "remove it" : "move it away")
            << std::flush;
  std::string typed;
  std::getline(std::cin, typed);
  if (typed != site.description.name) {
    throw std::runtime_error(fmt::format("'{}' is not the site's name, '{}': nothing is deleted",
                                         typed, site.description.name));
  }
  const fs::path away = Delete(site, arguments.now);
  std::cout << (away.empty() ? fmt::format("{}: removed\n", site.folder.string())
                             : fmt::format("{}: is {} now; remove that for the room\n",
                                           site.folder.string(), away.string()));
}

void CheckTags(const std::string& file) {
  const TagSizes sizes(ReadTagFile(file));
  std::cout << fmt::format("{}: {} tags\n", file, sizes.all().size());
}

void PrintTag(const std::string& out, int id, double size_mm) {
  const TagId tag{TagFamily::k36h11, id};
  constexpr mode_t kReadable = 0644;
  if (!WriteNewFile(out, TagSheet(tag, size_mm), kReadable)) {
    throw std::runtime_error(out + ": exists already");
  }
  std::cout << fmt::format(
      "{}: tag {}; print it at 100 %, and put into tags.yaml: {{ids: {}, size_m: {:g}}}\n", out,
      ToString(tag), id, 1e-3 * size_mm);
}

struct TagArguments {
  std::string file, out;
  int id = 0;
  double size_mm = kMaxSheetTag_mm;
};

void AddTags(CLI::App& app) {
  const auto arguments = std::make_shared<TagArguments>();
  CLI::App* tags = app.add_subcommand(
      "tags", "Checks a site's tags.yaml, or draws an AprilTag to print (docs/tags.md)");
  CLI::Option* file =
      tags->add_option("file", arguments->file, "tags.yaml")->check(CLI::ExistingFile);
  CLI::Option* print =
      tags->add_option("--print", arguments->out, "New FILE.svg: an A4 page")->excludes(file);
  tags->add_option("--id", arguments->id, "Of the tag, family 36h11")
      ->check(CLI::Range(0, NumTagIds(TagFamily::k36h11) - 1))
      ->capture_default_str()
      ->needs(print);
  tags->add_option("--size-mm", arguments->size_mm, "Side of the black square")
      ->check(Within(10, kMaxSheetTag_mm))
      ->capture_default_str()
      ->needs(print);
  tags->callback([arguments] {
    if (!arguments->out.empty()) {
      PrintTag(arguments->out, arguments->id, arguments->size_mm);
    } else if (!arguments->file.empty()) {
      CheckTags(arguments->file);
    } else {
      throw std::runtime_error("tags: give a tags.yaml, or --print FILE.svg");
    }
  });
}

CLI::App* AddSiteCommand(CLI::App& app, const std::string& name, const std::string& help,
                         const Shared& arguments) {
  CLI::App* command = app.add_subcommand(name, help);
  command->add_option("path", arguments->site, "The site's folder")->required();
  return command;
}

void AddReading(CLI::App& app, const Shared& arguments, LogReadings* readings) {
  CLI::App* list = app.add_subcommand("list", "The sites in a folder: name, size, folder, state");
  list->add_option("folder", arguments->site,
                   "Folder of sites (default: ~/.local/share/pangea and /var/lib/pangea)");
  list->callback([arguments] { List(arguments->site); });

  CLI::App* info = AddSiteCommand(
      app, "info", "What is in a site: keyframes, maps, anchors, damage; a server may run",
      arguments);
  info->callback([arguments] { RunInfo(*arguments); });

  CLI::App* out = AddSiteCommand(app, "export",
                                 "Trajectories (*.tum), map points (map.ply) and anchors "
                                 "(anchors.json, map.gltf), by a replay of "
                                 "the journal",
                                 arguments);
  out->add_option("--out", arguments->out, "New folder for them")->required();
  out->callback([arguments, readings] {
    for (const std::string& file :
         ExportSite(ReadSite(arguments->site), arguments->out, readings)) {
      std::cout << file << "\n";
    }
  });
}

void AddMaking(CLI::App& app, const Shared& arguments) {
  CLI::App* create = AddSiteCommand(app, "create", "A new site", arguments);
  create->add_option("--name", arguments->name, "Its name (default: its folder's)");
  create->add_option("--bus", arguments->bus,
                     "LCM URL of its server bus (default: the server's default; two sites that are "
                     "served at once need one each)");
  create->add_option("--link", arguments->link, "LCM URL of its link bus (default: likewise)");
  create->callback([arguments] { Create(*arguments); });

  CLI::App* backup = AddSiteCommand(
      app, "backup", "Copies a site while its server runs, and reads the copy again", arguments);
  backup->add_option("to", arguments->out, "New FILE.tar.zst, or a new folder, which is a site")
      ->required();
  backup->add_flag("--with-keys", arguments->with_keys, "The agents' keys too");
  backup->callback([arguments] { RunBackup(*arguments); });

  CLI::App* restore = app.add_subcommand("restore", "A site from a backup");
  restore->add_option("from", arguments->other, "FILE.tar.zst or folder of `backup`")
      ->required()
      ->check(CLI::ExistingPath);
  restore->add_option("path", arguments->site, "The new site's folder")->required();
  restore->callback([arguments] { RunRestore(*arguments); });

  CLI::App* merge = app.add_subcommand(
      "merge", "Two sites as one new one, whose server fuses their maps where they overlap");
  merge->add_option("first", arguments->site, "The older site's folder; its options are kept")
      ->required();
  merge->add_option("second", arguments->other, "The other's")->required();
  merge->add_option("--out", arguments->out, "The new site's folder")->required();
  merge->add_option("--name", arguments->name, "Its name (default: its folder's)");
  merge->add_flag("--with-keys", arguments->with_keys, "The agents' keys of both too");
  merge->callback([arguments] { RunMerge(*arguments); });
}

void AddChanging(CLI::App& app, const Shared& arguments) {
  CLI::App* compact = AddSiteCommand(
      app, "compact",
      "Drops repeats, replaced options and filled damage from the journal; no server may run",
      arguments);
  compact->add_flag("--thin", arguments->thin,
                    "Also keyframes of places that newer ones show (docs/sites.md); options/"
                    "thinning.yaml in the site says how");
  compact->callback([arguments] { RunCompact(*arguments); });

  CLI::App* remove = AddSiteCommand(
      app, "delete", "Asks for the site's name, and moves it to PATH.deleted-<UTC time>",
      arguments);
  remove->add_flag("--now", arguments->now, "Removes it");
  remove->callback([arguments] { RunDelete(*arguments); });
}

// The given command runs during parsing. `readings`: receives the damage of the logs that were
// read.
void AddCommands(CLI::App& app, LogReadings* readings, bool* lost) {
  const auto arguments = std::make_shared<Arguments>();
  arguments->lost = lost;
  AddReading(app, arguments, readings);
  AddMaking(app, arguments);
  AddChanging(app, arguments);
  AddTags(app);
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Makes, lists, backs up, merges, compacts, exports and deletes sites: named maps",
               "pangea-site");
  AddVersion(app);
  app.require_subcommand(1);
  app.footer(
      "Exit code: 0; 1 when something could not be done; 3 when a journal is damaged: the results "
      "are of the part that could be read; above 100 for a wrong command line.");
  LogReadings readings;
  bool lost = false;
  AddCommands(app, &readings, &lost);
  const int exit_code = TellLosses("pangea-site", readings, RunSubcommand(app, argc, argv));
  return exit_code == 0 && lost ? kExitLost : exit_code;
}

}  // namespace pangea::site
