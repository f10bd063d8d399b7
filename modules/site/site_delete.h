#pragma once

#include <filesystem>

#include "site/site.h"

namespace pangea::site {

// Takes the site away: its folder becomes <folder>.deleted-<UTC time>, which is returned; with
// `now` that is removed too, and the path is empty. Throws std::runtime_error when a server runs.
std::filesystem::path Delete(const Site& site, bool now);

}  // namespace pangea::site
