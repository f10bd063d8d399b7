#pragma once

// A site: a named map in a folder of its own.
//
//   site.yaml     its name, when it was made, the server's buses
//   journal.lcm   the map (agent_handler writes it)
//   keys/         a key for each agent that may join; mode 0700
//   options/      <process>.yaml
//   logs/         what the server's processes print
//   checkpoint/   what they made of the journal; without it they read all of that again
//   gateway/      what pangea-gateway keeps (admission.h, identity.h there); mode 0700
//   recordings/   what pages of phones have uploaded; mode 0700
//   lock          held by the server, and by what changes the site

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

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
  std::filesystem::path logs() const { return folder / "logs"; }
  std::filesystem::path checkpoints() const { return folder / "checkpoint"; }
  std::filesystem::path gateway() const { return folder / "gateway"; }
  std::filesystem::path recordings() const { return folder / "recordings"; }
};

// What a site is called that nobody gave a name.
std::string NameOfFolder(const std::filesystem::path& folder);
// Made now, on the default buses.
SiteDescription NewDescription(const std::string& name);

// Throws std::runtime_error that names the file, the field and the mend: there is no site, or
// site.yaml is not one's.
Site ReadSite(const std::filesystem::path& folder);

// A new site. The folder is made; one that exists is taken if it has nothing but what a site has.
// site.yaml comes last: a folder without it is no site yet. Throws std::runtime_error.
Site CreateSite(const std::filesystem::path& folder, const SiteDescription& description);

// ReadSite, or CreateSite with the folder's name where there is none yet.
Site OpenSite(const std::filesystem::path& folder);

// A folder beside `folder` in which a site is made ready; Commit gives it its name. What is not
// committed is removed.
class SiteInTheMaking {
 public:
  // Throws std::runtime_error when there is something at `folder` other than an empty folder.
  explicit SiteInTheMaking(const std::filesystem::path& folder);
  ~SiteInTheMaking();
  SiteInTheMaking(const SiteInTheMaking&) = delete;
  SiteInTheMaking& operator=(const SiteInTheMaking&) = delete;

  const std::filesystem::path& folder() const { return staging_; }
  // Writes site.yaml if there is none yet; what is in the folder is on the disk when it returns.
  void Commit(const SiteDescription& description);

 private:
  const std::filesystem::path target_;
  const std::filesystem::path staging_;
};

// One program at a time changes a site. Throws std::runtime_error that names the other's process
// id.
class SiteLock {
 public:
  explicit SiteLock(const Site& site);
  ~SiteLock();
  SiteLock(const SiteLock&) = delete;
  SiteLock& operator=(const SiteLock&) = delete;

 private:
  int fd_ = -1;
};

// Whose lock is on the site; nothing if nobody has one.
std::optional<int> UserOf(const Site& site);

// "20261123T055342Z"
std::string TimeForFileName();

}  // namespace pangea::site
