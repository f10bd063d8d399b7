#pragma once

// --recording ID=FOLDER of the command lines: an agent's recording, for its ground truth or images.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace pangea::session {

// Folders by agent; of an agent given twice the last. Throws std::runtime_error about what is not
// ID=FOLDER, and a folder that is not there.
std::map<int32_t, std::string> RecordingsById(const std::vector<std::string>& arguments);

}  // namespace pangea::session
