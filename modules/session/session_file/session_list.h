#pragma once

// Session files at hand, for people: what each is, who is in it, and what it lacks to be run.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace pangea::session {

// Where a session that is given by its name is looked for (sessions/demo.yaml is "demo"): sessions/
// here, or where there is none, those that are installed with the programs.
std::filesystem::path SessionFolder();

// The *.yaml of a folder, by name; empty when there is no such folder.
std::vector<std::filesystem::path> SessionFiles(const std::filesystem::path& folder);

// The file itself, or the session of this name. Throws std::runtime_error that names the nearest.
std::filesystem::path FindSessionFile(const std::string& name_or_file);

// A paragraph each: the file and its first comment; its agents, faults and expectations; what is
// missing. A file that is wrong is told with its error.
std::string DescribeSessions(const std::vector<std::filesystem::path>& files,
                             const std::optional<std::filesystem::path>& recordings);

}  // namespace pangea::session
