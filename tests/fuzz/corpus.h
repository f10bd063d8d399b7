#pragma once

// The output of make_corpus: one folder per fuzz target.

#include <filesystem>
#include <string>
#include <utility>

#include "fuzz.h"

namespace pangea::fuzz {

class Corpus {
 public:
  explicit Corpus(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void Add(const std::string& target, const std::string& name, Bytes bytes) const {
    std::filesystem::create_directories(folder_ / target);
    WriteFile(folder_ / target / ("seed_" + name), bytes);
  }
  void AddText(const std::string& target, const std::string& name, const std::string& text) const {
    Add(target, name, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  }

 private:
  std::filesystem::path folder_;
};

// Adds the seeds that are texts: options files, requests to the anchors' API, recordings.
void AddTexts(const Corpus& corpus);

}  // namespace pangea::fuzz
