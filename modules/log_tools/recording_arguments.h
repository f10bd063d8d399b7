#pragma once

// --recording ID=FOLDER of the command lines: an agent's recording, for its ground truth or images.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "log_file/log_reading.h"

namespace pangea::session {

// Folders by agent; of an agent given twice the last. Throws std::runtime_error about what is not
// ID=FOLDER, and a folder that is not there.
std::map<int32_t, std::string> RecordingsById(const std::vector<std::string>& arguments);

// The same; throws too about an agent that is not in the logs.
std::map<int32_t, std::string> RecordingsOf(const std::vector<std::string>& arguments,
                                            const std::vector<std::string>& logs,
                                            LogReadings* readings = nullptr);

}  // namespace pangea::session
