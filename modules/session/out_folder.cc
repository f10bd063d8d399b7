#include "session/out_folder.h"

#include <fmt/format.h>

#include <iostream>
#include <stdexcept>
#include <system_error>

#include "files/make_folder.h"

namespace pangea::session {

namespace fs = std::filesystem;

namespace {

// recordings.json is written first: a session that could not start has left nothing else of note.
bool HoldsSession(const fs::path& folder) {
  return fs::exists(folder / "session.lcm") || fs::exists(folder / "recordings.json");
}

bool IsWithin(const fs::path& path, const fs::path& folder) {
  const fs::path inside = fs::weakly_canonical(path).lexically_relative(fs::canonical(folder));
  return !inside.empty() && *inside.begin() != "..";
}

}  // namespace

void CheckNothingNeededIsIn(const fs::path& out, const std::vector<fs::path>& needed) {
  for (const fs::path& path : needed) {
    if (HoldsSession(out) && fs::exists(path) && IsWithin(path, out)) {
      throw std::runtime_error(
          fmt::format("--out {}: holds an earlier session, and with it {}, which this one needs; "
                      "give another folder",
                      out.string(), path.string()));
    }
  }
}

void CheckNothingIsReplaced(const fs::path& out, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (!HoldsSession(out) && fs::exists(out / name)) {
      throw std::runtime_error(
          fmt::format("--out {}: '{}' in it is of no session, and this one would use that name; "
                      "give another folder",
                      out.string(), name));
    }
  }
}

OutFolder::OutFolder(const fs::path& given) : folder_(WithoutSlash(given)) {
  if (fs::exists(folder_) && !fs::is_directory(folder_)) {
    throw std::runtime_error(fmt::format("--out {}: is a file, not a folder", given.string()));
  }
  if (HoldsSession(folder_)) {
    MoveAside(given);
  }
  MakeFolder(folder_);
}

void OutFolder::MoveAside(const fs::path& given) {
  if (folder_ == "." || folder_.filename() == "..") {
    throw std::runtime_error(fmt::format(
        "--out {}: holds an earlier session, and the folder one is in is not moved aside; give "
        "another folder",
        given.string()));
  }
  fs::path aside;
  for (int n = 1; aside.empty() || fs::exists(aside); ++n) {
    aside = folder_.string() + fmt::format(".{}", n);
  }
  std::error_code error;
  fs::rename(folder_, aside, error);
  if (error) {
    throw std::runtime_error(
        fmt::format("--out {}: holds an earlier session, which cannot be moved to {}: {}; give "
                    "another folder",
                    given.string(), aside.string(), error.message()));
  }
  std::cout << fmt::format("moved the earlier session in {} to {}\n", folder_.string(),
                           aside.string());
  aside_ = aside;
}

OutFolder::~OutFolder() {
  std::error_code error;
  if (!aside_ || !fs::is_empty(folder_, error) || error) {
    return;
  }
  fs::remove(folder_, error);
  fs::rename(*aside_, folder_, error);
  if (!error) {
    std::cout << fmt::format("moved it back to {}\n", folder_.string());
  }
}

}  // namespace pangea::session
