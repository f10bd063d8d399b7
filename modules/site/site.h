#pragma once

// A site: a named map in a folder of its own.
//
//   site.yaml     its name, when it was made, the server's buses
//   journal.lcm   the map (agent_handler writes it)
//   keys/         a key for each agent that may join; mode 0700
//   options/      <process>.yaml
//   tags.yaml     the sizes of its AprilTags, if there are any (docs/tags.md)
//   logs/         what the server's processes print
//   checkpoint/   checkpoints of the server's processes; without them they read the whole journal
//   gateway/      data of pangea-gateway (its admission.h, identity.h); mode 0700
//   recordings/   recordings uploaded by phones; mode 0700
//   lock          locked by the server, and by programs that change the site

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace pangea::site {

struct SiteDescription {
  static constexpr int32_t kFormat = 1;
  int32_t format = kFormat;
  std::string name;     // 1 to 100 bytes, printable
  std::string created;  // "2026-11-23T05:53:42Z"
  std::string bus;      // LCM URLs
  std::string link;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("format", &format, {1, 1e9}, "", "");
    archive.Add("name", &name);
    archive.Add("created", &created);
    archive.Add("bus", &bus);
    archive.Add("link", &link);
  }
};

struct Site {
  std::filesystem::path folder;
  SiteDescription description;

  std::filesystem::path file() const { return folder / "site.yaml"; }
  std::filesystem::path journal() const { return folder / "journal.lcm"; }
  std::filesystem::path keys() const { return folder / "keys"; }
  std::filesystem::path options() const { return folder / "options"; }
  std::filesystem::path tags() const { return folder / "tags.yaml"; }
  std::filesystem::path logs() const { return folder / "logs"; }
  std::filesystem::path checkpoints() const { return folder / "checkpoint"; }
  std::filesystem::path gateway() const { return folder / "gateway"; }
  std::filesystem::path recordings() const { return folder / "recordings"; }
};

// A path as a shell command has it: in quotes if it has blanks or the like.
std::string InShell(const std::filesystem::path& path);

// The default name of a site.
std::string NameOfFolder(const std::filesystem::path& folder);
// A description with the present time and the default buses.
SiteDescription NewDescription(const std::string& name);

// The name of a file in the folder that is nothing of a site's; empty if there is none.
std::string ForeignFile(const std::filesystem::path& folder);
// The sites in folders of this one, which no command takes along: earlier versions let them be made
// there.
std::vector<std::filesystem::path> SitesInside(const Site& site);
// Throws std::runtime_error if a new file or folder would be inside a site.
void RequireOutsideSites(const std::filesystem::path& path);

// Throws std::runtime_error with file, field and correction if there is no site or its site.yaml is
// invalid.
Site ReadSite(const std::filesystem::path& folder);

// Creates a site. The folder is created; an existing one is used if it has only files of a site.
// site.yaml is written last: a folder without it is not a site yet. Throws std::runtime_error, also
// if the folder is inside a site.
Site CreateSite(const std::filesystem::path& folder, const SiteDescription& description);

// ReadSite, or, if there is no site, CreateSite with the folder's name.
Site OpenSite(const std::filesystem::path& folder);

// A temporary folder beside `folder` in which a site is prepared; Commit renames it to `folder`.
// Without Commit it is removed.
class SiteInTheMaking {
 public:
  // Throws std::runtime_error if `folder` exists and is not an empty folder, or is inside a site.
  explicit SiteInTheMaking(const std::filesystem::path& folder);
  ~SiteInTheMaking();
  SiteInTheMaking(const SiteInTheMaking&) = delete;
  SiteInTheMaking& operator=(const SiteInTheMaking&) = delete;

  const std::filesystem::path& folder() const { return staging_; }
  // Writes site.yaml if there is none, flushes the folder's files to the disk, and renames the
  // folder.
  void Commit(const SiteDescription& description);

 private:
  const std::filesystem::path target_;
  const std::filesystem::path staging_;
};

// Only one program at a time may change a site. The constructor throws std::runtime_error with the
// process id of the other program if the site is locked.
class SiteLock {
 public:
  explicit SiteLock(const Site& site);
  ~SiteLock();
  SiteLock(const SiteLock&) = delete;
  SiteLock& operator=(const SiteLock&) = delete;

 private:
  int fd_ = -1;
};

// Process id of the program that has locked the site; empty if none has.
std::optional<int> UserOf(const Site& site);

// "20261123T055342Z"
std::string TimeForFileName();

}  // namespace pangea::site
