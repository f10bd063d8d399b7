// The part of a server that a test of the page needs to change anchors: it gives edits of tools
// their number, and publishes them as if they were journalled. pangea-anchors does the rest.
//   pangea-viewer-test-journal URL

#include <iostream>
#include <map>
#include <string>
#include <utility>

#include "bus/bus.h"
#include "bus/process.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"

namespace {

using namespace pangea;

class TestJournal {
 public:
  explicit TestJournal(LcmBus& bus) : bus_(bus) {
    bus.Subscribe(channels::AnchorRequest(0), [this](const std::string&, Bytes data) {
      anchor_edit_t edit{};
      if (DecodeMessage(data, &edit) && Parse(edit).value) {
        Take(edit);
      }
    });
  }

 private:
  void Take(anchor_edit_t edit) {
    const std::pair<AnchorId, int64_t> key{*Parse(edit.anchor).value, edit.revision};
    edit.seq = static_cast<int64_t>(edits_.size());
    edit.may = anchor_edit_t::MAY_EDIT_ALL;
    const auto journalled = edits_.try_emplace(key, std::move(edit)).first;
    PublishMessage(bus_, std::string(channels::kAnchorEdit), journalled->second);
  }

  LcmBus& bus_;
  std::map<std::pair<AnchorId, int64_t>, anchor_edit_t> edits_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: pangea-viewer-test-journal URL\n";
    return 2;
  }
  InstallSignalHandlers();
  LcmBus bus(argv[1]);
  const TestJournal journal(bus);
  while (!StopRequested()) {
    bus.Handle(100);
  }
  return 0;
}
