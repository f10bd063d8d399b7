#pragma once

// A host that may become the core of a site: its journal follows the site's stream until it has the
// lease and the journal has all that was stored before. Then a server may start on the journal, and
// a bridge of role core with the same holder's name beside it.

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

  // At about 10 Hz; true once this host is the core. Throws std::runtime_error when
  // the journal cannot be that of the site, or be written.
  bool Step(int64_t now_utime);
  // For people.
  std::string Said() const;

 private:
  const std::filesystem::path journal_;
  SiteStreams& streams_;
  SiteLease lease_;
  JournalCopy copy_;
  uint64_t begin_ = 0;  // of our term in the stream; 0: we have none
};

}  // namespace pangea
