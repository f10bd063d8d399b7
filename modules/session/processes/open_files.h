#pragma once

#include <cstddef>

namespace pangea::session {

// Lets this process have `count` files open at once: the soft limit (RLIMIT_NOFILE), 1024 by
// custom, is raised to it. Throws std::runtime_error that names both where the hard limit is below.
void AllowOpenFiles(size_t count);

}  // namespace pangea::session
