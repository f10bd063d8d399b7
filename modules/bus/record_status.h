#pragma once

// Reports keyframes that found no room in the RecordStore in a process' status.

#include <string>

#include "bus/node.h"
#include "core/record_store.h"

namespace pangea {

// Sets the node's counters of records, if they are not zero, and returns an end for the status'
// summary: empty, or "; 12 keyframes in memory: the scratch file in /var/tmp cannot be written: No
// space left on device". Without a RecordStore, keyframes in memory are normal and not mentioned.
std::string NoteRecords(const RecordCounters& counters, const RecordStore* records, Node* node);

}  // namespace pangea
