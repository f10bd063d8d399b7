// A journal or a log of keyframes as a crash, a full disk or a stranger left it.

#include <fstream>
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

// A log is good, or it says what is wrong.
bool Opens(const std::function<void()>& open) {
  try {
    open();
    return true;
  } catch (const std::runtime_error&) {
    return false;
  }
}

}  // namespace
}  // namespace pangea::fuzz

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace pangea;
  const auto log = fuzz::ScratchFolder() / "journal.lcm";
  fuzz::WriteFile(log, {data, size});
  fuzz::Opens([&] { session::ReadKeyframeLog(log); });
  fuzz::Opens([&] { session::ReadKeyframeLogOf(log, 1); });
  if (fuzz::Opens([&] { fuzz::StartOn(log); })) {
    const auto healed = std::filesystem::file_size(log);
    fuzz::Require(fuzz::Opens([&] { fuzz::StartOn(log); }), "a journal that opened opens again");
    fuzz::Require(std::filesystem::file_size(log) == healed, "what was healed once stays");
  }
  return 0;
}
