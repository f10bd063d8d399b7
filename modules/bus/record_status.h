#pragma once

// What a process' status says of keyframes that found no room in its RecordStore.

#include <string>

#include "bus/node.h"
#include "core/record_store.h"

namespace pangea {

// Sets the counters that are not zero, and returns what the summary ends with: nothing, or
// "; 12 keyframes in memory: the scratch file in /var/tmp cannot be written: No space left on
// device". Without a RecordStore memory is where they belong.
std::string NoteRecords(const RecordCounters& counters, const RecordStore* records, Node* node);

}  // namespace pangea
