// A journal or a log of keyframes after a crash, on a full disk, or from a stranger.

#include <algorithm>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>

#include "agent_handler/agent_handler_process.h"
#include "fuzz.h"
#include "replay/keyframe_log.h"

namespace pangea::fuzz {
namespace {

void StartOn(const std::filesystem::path& journal) {
  QuickBus bus;
  AgentHandlerProcess process(bus, bus, journal.string(), ScratchFolder().string(), 1'000'000,
                              AgentHandlerOptions{});
  process.Tick(2'000'000);
  process.Poll(2'000'000);
  bus.Drain();
}

// A log either opens or throws an error with a message.
bool Opens(const std::function<void()>& open) {
  try {
    open();
    return true;
  } catch (const std::runtime_error&) {
    return false;
  }
}

std::vector<char> BytesOf(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

bool IsSame(const std::vector<char>& a, Bytes b) {
  return std::ranges::equal(a, b, {}, [](char c) { return static_cast<uint8_t>(c); });
}

int64_t NumFiles(const std::filesystem::path& folder) {
  return std::distance(std::filesystem::directory_iterator(folder), {});
}

}  // namespace
}  // namespace pangea::fuzz

static int FuzzJournal(const uint8_t* data, size_t size) {
  using namespace pangea;
  std::cerr.rdbuf(nullptr);  // each damaged journal prints a warning
  const auto folder = fuzz::ScratchFolder() / "journal";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const auto log = folder / "journal.lcm";
  fuzz::WriteFile(log, {data, size});
  LogReadings readings;
  fuzz::Opens([&] { ReadKeyframeLog(log, &readings); });
  fuzz::Opens([&] { ReadKeyframeLogOf(log, 1, &readings); });
  if (fuzz::Opens([&] { fuzz::StartOn(log); })) {
    const std::vector<char> healed = fuzz::BytesOf(log);
    const int64_t files = fuzz::NumFiles(folder);
    fuzz::Require(files == 2 || fuzz::IsSame(healed, {data, size}),
                  "what is mended is kept beside");
    fuzz::Require(fuzz::Opens([&] { fuzz::StartOn(log); }), "a journal that opened opens again");
    fuzz::Require(fuzz::BytesOf(log) == healed, "what was healed once stays");
    fuzz::Require(fuzz::NumFiles(folder) == files, "and is whole");
  } else {
    fuzz::Require(fuzz::IsSame(fuzz::BytesOf(log), {data, size}), "what is refused stays as it is");
  }
  return 0;
}
static const pangea::fuzz::Target kJournal("journal", FuzzJournal);
