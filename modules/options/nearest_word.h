#pragma once

// Finds the known word that a person probably meant, for messages about unknown keys and names.

#include <optional>
#include <string>
#include <vector>

namespace pangea {

// The known word with the smallest edit distance; nothing if none is near.
std::optional<std::string> NearestWord(const std::string& word,
                                       const std::vector<std::string>& known);

// "; did you mean 'faults'?" if a known word is near, else "; known are a, b, c". `prefix`, such as
// "agents[0].", comes before the suggested word.
std::string NearestWordHint(const std::string& word, const std::vector<std::string>& known,
                            const std::string& prefix = "");

}  // namespace pangea
