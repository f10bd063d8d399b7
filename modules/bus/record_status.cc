#include "bus/record_status.h"

#include <fmt/format.h>

#include <cstdint>

namespace pangea {

std::string NoteRecords(const RecordCounters& counters, const RecordStore* records, Node* node) {
  const auto set = [node](const char* name, int64_t count) {
    if (count > 0) {
      node->Set(name, count);
    }
  };
  set("keyframes_dropped", counters.dropped);
  set("keyframes_unreadable", counters.unreadable);
  if (records == nullptr || records->problem().empty()) {
    return "";
  }
  set("keyframes_in_memory", counters.in_memory);
  return fmt::format("; {} keyframes in memory, {} dropped: {}", counters.in_memory,
                     counters.dropped, records->problem());
}

}  // namespace pangea
