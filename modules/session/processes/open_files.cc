#include "session/processes/open_files.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <stdexcept>

namespace pangea::session {

void AllowOpenFiles(size_t count) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= count) {
    return;
  }
  limit.rlim_cur = count;
  if (limit.rlim_max < count || setrlimit(RLIMIT_NOFILE, &limit) != 0) {
    throw std::runtime_error(
        fmt::format("this session needs {} open files, and {} are allowed here (ulimit -Hn): raise "
                    "that, or give the session fewer agents",
                    count, limit.rlim_max));
  }
}

}  // namespace pangea::session
