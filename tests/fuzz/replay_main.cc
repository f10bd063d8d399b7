// replay_main TARGET FOLDER: feeds every file of the folder to a fuzz target, so that an error once
// found stays mended. Then it feeds mutants of the files for a second: the bounded run of every
// build. The mutants are the same in each run, up to the number that the time allows. libFuzzer,
// which is guided by coverage, goes further (scripts/fuzz).

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "fuzz.h"

namespace {

namespace fs = std::filesystem;
using Input = std::vector<uint8_t>;
using Clock = std::chrono::steady_clock;

constexpr auto kMutantsFor = std::chrono::seconds(1);
constexpr int kMaxMutants = 5000;

std::vector<fs::path> FilesOf(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

Input Read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// An input of the corpus with some bytes flipped, filled, removed, doubled, or taken from another
// input.
Input Mutant(const std::vector<Input>& corpus, std::mt19937_64& rng) {
  constexpr uint8_t kExtremes[] = {0x00, 0x7F, 0x80, 0xFF};
  Input input = corpus[rng() % corpus.size()];
  const Input& other = corpus[rng() % corpus.size()];
  for (uint64_t changes = 1 + rng() % 4; changes > 0 && !input.empty(); --changes) {
    const size_t begin = rng() % input.size();
    const size_t size = 1 + rng() % std::min<size_t>(64, input.size() - begin);
    const auto from = input.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto to = from + static_cast<std::ptrdiff_t>(size);
    switch (rng() % 5) {
      case 0:
        *from ^= static_cast<uint8_t>(1 << (rng() % 8));
        break;
      case 1:
        std::fill(from, to, kExtremes[rng() % std::size(kExtremes)]);
        break;
      case 2:
        input.erase(from, to);
        break;
      case 3: {
        const Input part(from, to);
        input.insert(from, part.begin(), part.end());
        break;
      }
      default:
        std::copy_n(other.begin(), std::min(size, other.size()), from);
    }
  }
  return input;
}

// Replaces the file's content. The file stays open, as opening it each time would wait for the
// disk.
void Keep(int file, const Input& input) {
  pangea::fuzz::Require(
      pwrite(file, input.data(), input.size(), 0) == static_cast<ssize_t>(input.size()) &&
          ftruncate(file, static_cast<off_t>(input.size())) == 0,
      "the folder can be written");
}

}  // namespace

int main(int argc, char** argv) {
  const std::string name = argc == 3 ? argv[1] : "";
  const auto found = pangea::fuzz::Targets().find(name);
  if (found == pangea::fuzz::Targets().end()) {
    std::fprintf(stderr, "usage: fuzz.replay TARGET FOLDER\n");
    return 2;
  }
  const pangea::fuzz::TargetFunction target = found->second;
  std::vector<Input> corpus;
  for (const fs::path& file : FilesOf(argv[2])) {
    std::printf("%s\n", file.filename().c_str());  // the last file named caused a crash
    std::fflush(stdout);
    corpus.push_back(Read(file));
    target(corpus.back().data(), corpus.back().size());
  }
  if (corpus.empty()) {
    return 1;
  }
  // The file stays if an input ends the process: that input belongs into the corpus.
  const fs::path culprit = "fuzz." + name + ".culprit";
  const int file = open(culprit.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0644);
  std::mt19937_64 rng(1);
  int mutants = 0;
  for (const auto end = Clock::now() + kMutantsFor; mutants < kMaxMutants && Clock::now() < end;
       ++mutants) {
    const Input mutant = Mutant(corpus, rng);
    Keep(file, mutant);
    target(mutant.data(), mutant.size());
  }
  close(file);
  fs::remove(culprit);
  std::printf("%zu inputs, %d mutants\n", corpus.size(), mutants);
  return 0;
}
