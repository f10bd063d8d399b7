#pragma once

// Lists session files for people: description, agents, and missing inputs of each.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace pangea::session {

// The folder of sessions that are given by name ("demo" is sessions/demo.yaml): sessions/ in the
// working directory, else the folder installed with the programs.
std::filesystem::path SessionFolder();

// The *.yaml files of a folder, by name; empty if there is no such folder.
std::vector<std::filesystem::path> SessionFiles(const std::filesystem::path& folder);

// The file itself, or the session with this name. Throws std::runtime_error with the most similar
// name.
std::filesystem::path FindSessionFile(const std::string& name_or_file);

// One paragraph per file: name and first comment; agents, faults and expectations; missing inputs.
// For an invalid file: its error.
std::string DescribeSessions(const std::vector<std::filesystem::path>& files,
                             const std::optional<std::filesystem::path>& recordings);

}  // namespace pangea::session
