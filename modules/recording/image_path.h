#pragma once

// Finds the image files that cam0/data.csv names.

#include <string>

namespace pangea {

// The file of an image, by its name in mav0/cam0/data.csv: relative to cam0/data as in EuRoC, or,
// as some programs write it, to cam0, to mav0 or to the folder above, with '\' for '/', or
// absolute. If none of these is there, the first: cam0/data/<name>.
std::string ImagePath(const std::string& mav0, const std::string& name);

}  // namespace pangea
