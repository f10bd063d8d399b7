#pragma once

#include <filesystem>

#include "site/site.h"

namespace pangea::site {

// In the name of a deleted site's folder, before the time.
inline constexpr char kDeletedMark[] = ".deleted-";

// Deletes a site: renames its folder to <folder>.deleted-<UTC time> and returns that path. With
// `now` the folder is removed too, and the path is empty. Throws std::runtime_error if a server
// runs, or if files that are nothing of the site's would be removed.
std::filesystem::path Delete(const Site& site, bool now);

}  // namespace pangea::site
