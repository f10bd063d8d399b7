#pragma once

#include <cstddef>

namespace pangea::session {

// Raises the soft limit on open files (RLIMIT_NOFILE, usually 1024) to `count`. Throws
// std::runtime_error that names both limits if the hard limit is lower.
void AllowOpenFiles(size_t count);

}  // namespace pangea::session
