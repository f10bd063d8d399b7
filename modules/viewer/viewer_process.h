#pragma once

// A live bus as a show: everything people may want to see of it in, STATUS_viewer out. A viewer
// that starts late asks for the keyframes and verification results it missed, as any process does.

#include <set>
#include <string>

#include "bus/bus.h"
#include "bus/node.h"
#include "bus/process.h"
#include "bus/retransmission/missing.h"
#include "messages/catch_up_messages.h"
#include "viewer/scene/scene_events.h"
#include "viewer/show.h"

namespace pangea::viewer {

class ViewerProcess : public Process, public Show {
 public:
  ViewerProcess(Bus& bus, std::string source, int64_t start_utime);

  // An agent's own bus: its images, which do not go further.
  void WatchAgent(Bus& agent_bus);

  void Tick(int64_t now_utime) override;

  const Scene& scene() const override { return scene_; }
  int64_t epoch() const override { return 1; }
  ShowClock clock() const override { return clock_; }
  std::string source() const override { return source_; }

 private:
  void OnMessage(const std::string& channel, Bytes data);
  void OnHave(const Have& have);
  void AskForMissing(int64_t now_utime);

  Node node_;
  std::string source_;
  int64_t start_utime_;
  Scene scene_;
  SceneEvents events_;
  ShowClock clock_;
  MissingMessages keyframes_;
  std::set<MapId> results_requested_;  // maps whose verification results of before were asked for
  int64_t next_status_utime_ = 0;
};

}  // namespace pangea::viewer
