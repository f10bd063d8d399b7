#pragma once

// Which known word did they mean? For messages about keys and names that are not known.

#include <optional>
#include <string>
#include <vector>

namespace pangea {

// Nothing when none is near.
std::optional<std::string> NearestWord(const std::string& word,
                                       const std::vector<std::string>& known);

// "; did you mean 'faults'?" when a known word is near, with `prefix` before it ("agents[0]."),
// else
// "; known are a, b, c".
std::string NearestWordHint(const std::string& word, const std::vector<std::string>& known,
                            const std::string& prefix = "");

}  // namespace pangea
