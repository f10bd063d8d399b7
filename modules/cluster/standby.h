#pragma once

// A host that may become the core of a site. Its journal follows the site's stream until the host
// has the lease and the journal has everything that was stored before. Then a server may start with
// this journal, and beside it a bridge of role core with the same holder's name.

#include <cstdint>
#include <filesystem>
#include <string>

#include "cluster/journal_copy.h"
#include "cluster/site_lease.h"
#include "cluster/site_streams.h"

namespace pangea {

class Standby {
 public:
  Standby(const std::filesystem::path& journal, SiteStreams& streams, const std::string& holder);

  // Call it at about 10 Hz. True once this host is the core. Throws std::runtime_error when the
  // journal is another site's or cannot be written.
  bool Step(int64_t now_utime);
  // The state, for people.
  std::string Said() const;

 private:
  const std::filesystem::path journal_;
  SiteStreams& streams_;
  SiteLease lease_;
  JournalCopy copy_;
  uint64_t begin_ = 0;  // sequence of our term in the stream; 0: we do not have the lease
};

}  // namespace pangea
