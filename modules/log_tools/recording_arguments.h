#pragma once

// The command-line option --recording ID=FOLDER: an agent's recording, for its ground truth or
// images.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "log_file/log_reading.h"

namespace pangea {

// Folders by agent; if an agent is given twice, the last one. Throws std::runtime_error for an
// argument that is not ID=FOLDER, or a missing folder.
std::map<int32_t, std::string> RecordingsById(const std::vector<std::string>& arguments);

// The same; also throws for an agent that is not in the logs.
std::map<int32_t, std::string> RecordingsOf(const std::vector<std::string>& arguments,
                                            const std::vector<std::string>& logs,
                                            LogReadings* readings = nullptr);

}  // namespace pangea
